# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings that are kept in the .blend, on the Scene. Enum numbers and names must not change."""

from collections.abc import Callable

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from .. import native
from ..fit.settings import PRESETS, FitSettings
from ..scene_read import hosts
from .captures.controls import properties_of_group
from .captures.lights import SeleniteCaptureLights
from .captures.photo import SeleniteCapturePhoto
from .furniture.preset_items import PRESET_ITEMS
from .output_folder import DEFAULT_FOLDER
from .result.properties import SeleniteResult
from .rows.properties import SeleniteOwner, SeleniteRow
from .texts import TITLES

SCHEMA = 1

_DEFAULTS = FitSettings()


def _loss_items() -> tuple[tuple[str, str, str, int], ...]:
    """The native list. Where it does not load, the panel says so and no fit can be started."""
    try:
        rows = native.core().losses()
    except native.NativeUnavailable:
        return ((_DEFAULTS.loss, _DEFAULTS.loss, "", 0),)
    return tuple((row["name"], row["title"], row["help"], at) for at, row in enumerate(rows))


LOSS_ITEMS = _loss_items()
OPTIMISER_ITEMS = (
    ("auto", "Automatic", "Gauss-Newton where few numbers are fitted, else Adam", 0),
    ("gauss-newton", "Gauss-Newton", "Least squares, by the derivatives of all iterations", 1),
    ("adam", "Adam", "Gradient steps at each parameter's rate; wants more iterations", 2),
)
TITLES.update({name: title for name, title, *_ in (*LOSS_ITEMS, *OPTIMISER_ITEMS)})
PRECISION_ITEMS = (
    ("draft", "Draft", "90 % intervals within 3 % of the bounds' distance or 6 % of the value", 0),
    ("usual", "Usual", "90 % intervals within 1 % of the bounds' distance or 2 % of the value", 1),
    ("exact", "Exact", "As narrow as all samples make them", 2),
)
PRIOR_ITEMS = (
    (
        "agreement",
        "What Photos Agree On",
        "Differences that follow a texel through several photos are pattern; the others hold "
        "it back",
        0,
    ),
    ("misfit", "Whole Misfit", "All differences from the photos hold the pattern back", 1),
)
SEARCH_ITEMS = (
    ("auto", "Where Useful", "Evaluate many starting points where few parameters are fitted", 0),
    ("on", "Always", "Evaluate many starting points", 1),
    ("off", "Never", "Step from the given start", 2),
)
# Beside the own list, the names are those of fit.staging.request. 4 was "auto" in older files.
STAGE_ITEMS = (
    (
        "usual",
        "Usual",
        "Light First where the world's image, an image and its colour are ticked, else All at Once",
        6,
    ),
    ("none", "All at Once", "Every ticked parameter in every iteration", 0),
    ("ior-last", "IOR Last", "Everything but indices of refraction first, then everything", 1),
    (
        "colours-first",
        "Colours First",
        "Colours first, then everything; an albedo before its grid",
        2,
    ),
    (
        "light-first",
        "Light First",
        "The world's image with one colour first, then images and grids under that light",
        5,
    ),
    ("own", "Own List", "What the stages below name; ticks do not count", 3),
)


# Beside the first, the names are those of fit.model_chain.
BODY_ITEMS = (
    ("ticked", "As Ticked", "The ticked parameters of the material as it is", 0),
    (
        "auto",
        "Automatic",
        "Opaque; where photos show light through the body, then a medium and its albedo grids",
        1,
    ),
    ("opaque", "Opaque", "Roughness and base colour, as an image where the mesh has UVs", 2),
    ("subsurface", "Subsurface", "Opaque first, then with subsurface scattering", 3),
    ("medium", "Translucent", "Rough glass over a medium, then its albedo as a grid", 4),
)


def _is_camera(_self: bpy.types.bpy_struct, item: bpy.types.Object) -> bool:
    return item.type == "CAMERA"


def _show_photo(capture: bpy.types.PropertyGroup, _context: bpy.types.Context) -> None:
    """The photo also becomes the camera's background image, so that it can be compared by eye."""
    if capture.camera is None or capture.photo is None:
        return
    data = capture.camera.data
    if not hosts.is_editable(data):
        return
    backgrounds = data.background_images
    background = backgrounds[0] if len(backgrounds) else backgrounds.new()
    background.image = capture.photo
    background.frame_method = "CROP"
    data.show_background_images = True


def _take_iterations(settings: bpy.types.PropertyGroup, _context: bpy.types.Context) -> None:
    """A number that is asked for is the most there are."""
    settings.until_converged = False


def _take_preset(settings: bpy.types.PropertyGroup, _context: bpy.types.Context) -> None:
    preset = PRESETS[settings.preset]
    for name in (
        "iterations",
        "until_converged",
        "spp",
        "height",
        "tolerance",
        "picture_spp",
        "precision",
    ):
        setattr(settings, name, getattr(preset, name))


class SeleniteCapture(bpy.types.PropertyGroup):
    """A camera and the photo that was taken from there."""

    enabled: BoolProperty(name="Use", default=True, description="Compare with this photo")
    camera: PointerProperty(
        name="Camera",
        type=bpy.types.Object,
        poll=_is_camera,
        update=_show_photo,
        description="Camera that stands where the photo was taken",
    )
    photo: PointerProperty(
        name="Photo", type=bpy.types.Image, update=_show_photo, description="Photo of this camera"
    )
    mask_path: properties_of_group("")["mask_path"]
    how: PointerProperty(type=SeleniteCapturePhoto)
    lights: PointerProperty(type=SeleniteCaptureLights)


def _own(name: str) -> tuple[Callable[..., bool], Callable[..., None]]:
    """Getter and setter of whether a stage has a number of its own; it begins as the fit's."""

    def get(stage: bpy.types.PropertyGroup) -> bool:
        return getattr(stage, name) > 0

    def set_own(stage: bpy.types.PropertyGroup, value: bool) -> None:  # noqa: FBT001 - Blender's
        if value != get(stage):
            setattr(stage, name, getattr(stage.id_data.selenite, name) if value else 0)

    return get, set_own


def _own_property(name: str, label: str) -> object:
    get, set_own = _own(name)
    text = "A number of its own; otherwise as in the fit"
    return BoolProperty(name=label, description=text, get=get, set=set_own)


class SeleniteStage(bpy.types.PropertyGroup):
    """One stage of an own list. 0 means the fit's setting."""

    parameters: StringProperty(description="Names as on the command line, one a line")
    iterations: IntProperty(name="Iterations", min=0, description="Of this stage")
    spp: IntProperty(name="Samples", min=0, description="Of this stage")
    height: IntProperty(name="Height", min=0, subtype="PIXEL", description="Of this stage")
    own_iterations: _own_property("iterations", "Iterations")
    own_spp: _own_property("spp", "Samples")
    own_height: _own_property("height", "Height")


class SeleniteModel(bpy.types.PropertyGroup):
    """A model of the body that was fitted."""

    error: FloatProperty(description="Of the photos held out, relative; below 0: not known")
    kept: BoolProperty(description="Better than those before")
    scene: StringProperty(subtype="FILE_PATH", description="Scene with the fitted model")


class SeleniteSettings(bpy.types.PropertyGroup):
    """Everything that Selenite keeps in a scene."""

    schema: IntProperty(default=SCHEMA, description="Version of these properties")
    captures: CollectionProperty(type=SeleniteCapture)
    active_capture: IntProperty()
    rows: CollectionProperty(type=SeleniteRow)
    active_row: IntProperty()
    owners: CollectionProperty(type=SeleniteOwner)
    active_owner: IntProperty(
        name="Material, Lamp or World", description="Its parameters are listed below"
    )
    show_locked: BoolProperty(
        name="Show Locked",
        description="Also list the parameters that cannot be fitted; the tooltip says why",
    )
    stage_mode: EnumProperty(
        name="Stages",
        items=STAGE_ITEMS,
        default="usual",
        description="What is fitted first and what later",
    )
    stages: CollectionProperty(type=SeleniteStage)
    active_stage: IntProperty()
    body: EnumProperty(
        name="Body",
        items=BODY_ITEMS,
        default="ticked",
        description="Model of the photographed body: what is ticked, or models that are judged by "
        "photos held out",
    )
    models: CollectionProperty(type=SeleniteModel)
    active_model: IntProperty(name="Model", description="Apply Model takes this one")
    models_material: PointerProperty(type=bpy.types.Material, description="That of the models")
    models_sentence: StringProperty(description="By how much each model has helped")
    model_applied: StringProperty(description="Name of the model that the body has")
    results: CollectionProperty(type=SeleniteResult)
    applied: BoolProperty(description="The fitted values are in the scene")
    verdict: StringProperty(description="The result in one sentence")
    verdict_icon: StringProperty(description="How sure the whole is")
    is_wrong: BoolProperty(description="The pictures are to be compared before values are applied")
    table: StringProperty(description="Parameter, start, fitted, interval: lines, cells by tabs")
    report: StringProperty(description="Everything else that the fit reports, line by line")
    show_report: BoolProperty(
        name="Full Report", description="Everything that the fit reports about each value"
    )
    preset: EnumProperty(
        name="Quality",
        items=PRESET_ITEMS,
        default="balanced",
        update=_take_preset,
        description="Sets size, samples and iterations; Advanced shows and changes them",
    )
    loss: EnumProperty(
        name="Loss",
        items=LOSS_ITEMS,
        default=_DEFAULTS.loss,
        description="How the difference between render and photo is measured",
    )
    optimiser: EnumProperty(
        name="Optimiser",
        items=OPTIMISER_ITEMS,
        default="auto",
        description="How the next values follow from the derivatives",
    )
    accumulate: BoolProperty(
        name="One Step for All Photos",
        default=True,
        description="Otherwise Adam steps after each photo",
    )
    iterations: IntProperty(
        name="Iterations",
        description="Maximum number; a fit of few parameters stops earlier when it has converged. "
        "Refinement passes follow, with as many samples as all these iterations have",
        default=_DEFAULTS.iterations,
        update=_take_iterations,
        min=1,
        soft_max=1000,
    )
    until_converged: BoolProperty(
        name="Until Converged",
        default=_DEFAULTS.until_converged,
        description="Goes on to three times the iterations where values still move",
    )
    spp: IntProperty(
        name="Samples",
        default=_DEFAULTS.spp,
        min=1,
        soft_max=64,
        description="Samples per pixel and iteration",
    )
    height: IntProperty(
        name="Height",
        default=_DEFAULTS.height,
        min=1,
        soft_max=2048,
        subtype="PIXEL",
        description="Height of the compared pictures; never more than the photo's",
    )
    tolerance: FloatProperty(
        name="Tolerance",
        default=_DEFAULTS.tolerance,
        min=0.0,
        precision=5,
        description="Stop when the loss falls below; 0 never stops",
    )
    depth: IntProperty(
        name="Depth", default=0, min=0, description="Bounces of a path; 0 does not limit them"
    )
    seed: IntProperty(
        name="Seed",
        default=0,
        min=0,
        description="Of the random numbers: the same one gives the same values, bit by bit",
    )
    threads: IntProperty(name="Threads", default=0, min=0, description="0 uses all")
    search: EnumProperty(
        name="Multi-Start",
        items=SEARCH_ITEMS,
        default="auto",
        description="Evaluate 65 starting points within the bounds before the first step. "
        "Yours is kept unless another one is better by more than noise",
    )
    precision: EnumProperty(
        name="Precision",
        items=PRECISION_ITEMS,
        default=_DEFAULTS.precision,
        description="How well values are to be known. Refinement ends as soon as they are, or when "
        "more samples of these photos would not suffice",
    )
    prior: EnumProperty(
        name="Prior by",
        items=PRIOR_ITEMS,
        default=_DEFAULTS.prior,
        description="How far the prior holds back the pattern of grids and images where the model "
        "does not explain the photos",
    )
    physical_refraction: BoolProperty(
        name="Physical Refraction",
        default=False,
        description="No refraction of rough glass towards lights that no micronormal gives. "
        "Cycles has it, so leave this off to fit what Cycles renders",
    )
    bake: BoolProperty(
        name="Bake Unreadable Nodes",
        default=False,
        description="Cycles bakes outputs of nodes that Selenite does not evaluate into images, "
        "which are kept beside the results",
    )
    approximate: BoolProperty(
        name="Approximate Unreadable Materials",
        default=False,
        description="What still cannot be read is rendered as the nearest shader, and cannot be "
        "fitted; a warning names it",
    )
    picture_spp: IntProperty(
        name="Picture Samples",
        default=_DEFAULTS.picture_spp,
        min=1,
        description="Samples per pixel of the pictures in the result folder",
    )
    trade_budget: FloatProperty(
        name="Budget",
        default=300.0,
        min=1.0,
        soft_max=3600.0,
        precision=0,
        description="Seconds that the measurement of time against error may take",
    )
    output: StringProperty(
        name="Folder",
        default=DEFAULT_FOLDER,
        subtype="DIR_PATH",
        description="Gets one folder per saved result",
    )


CLASSES = (
    SeleniteCapture,
    SeleniteOwner,
    SeleniteRow,
    SeleniteResult,
    SeleniteStage,
    SeleniteModel,
    SeleniteSettings,
)
