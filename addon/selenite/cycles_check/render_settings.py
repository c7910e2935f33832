# SPDX-License-Identifier: GPL-3.0-or-later
"""The render settings of a scene that decide whether Cycles shows what was fitted.

A fit sees the full, unclamped, unfiltered transport of light. The factory settings of Cycles do
not: they clamp, filter, denoise and end paths early. One table serves three purposes: a comparison
render sets all of it, the remarks tell what of it would spoil the artist's own picture and what
that costs, and "Set Cycles for the Fit" sets just that. The costs were measured with bpy 4.5
(change of the mean of a whole picture; docs/guide/cycles.md).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, cast

import bpy

from ..messages import message
from ..scene_read import hosts
from .setting_text import setting_text

if TYPE_CHECKING:
    from .report import RemarkRow

#: Bounces that count as unlimited: Russian roulette has ended nearly every path before.
MANY = 1024
ENOUGH = 64


@dataclass(frozen=True)
class Setting:
    """One row of the table.

    path: from the scene. value: of a comparison render. spoils: true of a value with which the
    artist's picture differs from the fit; None where it cannot. cost: what that value does. needs:
    what the scene must hold for it to matter (a field of Needs). remark: it differs, but no
    parameter would be fitted otherwise; such a setting stays the artist's choice.
    """

    name: str
    path: str
    value: object
    spoils: Callable[[Any], bool] | None = None
    cost: str = ""
    needs: str = ""
    remark: bool = False


@dataclass(frozen=True)
class Remark:
    """A setting that differs from what the fit sees; `spoils` is False for a mere remark."""

    name: str
    value: str
    wanted: str
    cost: str
    spoils: bool

    def line(self) -> str:
        """As one line of text."""
        return message(
            "render_settings.fit",
            "{name} is {value} (fit: {wanted}): {cost}",
            name=self.name,
            value=self.value,
            wanted=self.wanted,
            cost=self.cost,
        )

    def as_json(self) -> RemarkRow:
        """For the report of a check."""
        return cast("RemarkRow", asdict(self))


@dataclass(frozen=True)
class Contents:
    """What is found by walking through the objects and nodes of a scene.

    random_walks: names of materials whose Multiscatter GGX is a stochastic walk (Blender 3).
    shifted: number of meshes with a shadow terminator geometry offset.
    """

    volume: bool = False
    transmission: bool = False
    alpha: bool = False
    random_walks: tuple[str, ...] = ()
    shifted: int = 0


def _positive(value: float) -> bool:
    return value > 0


def _few(value: int) -> bool:
    return value < ENOUGH


def _off(value: bool) -> bool:
    return not value


def _on(value: bool) -> bool:
    return value


SETTINGS = (
    Setting(
        "Render Engine",
        "render.engine",
        "CYCLES",
        lambda value: value != "CYCLES",
        message("render_settings.only-cycles-renders-what", "only Cycles renders what was fitted"),
    ),
    Setting(
        "Volume Bounces",
        "cycles.volume_bounces",
        MANY,
        _few,
        message(
            "render_settings.shows-single-scattering-picture",
            "0 shows single scattering: 27 % of a picture with a dense bright medium",
        ),
        needs="volume",
    ),
    Setting(
        "Transmission Bounces",
        "cycles.transmission_bounces",
        MANY,
        _few,
        message(
            "render_settings.them-all-lose-picture",
            "12 of them and 12 in all lose 1 to 2 % of a picture with glass",
        ),
        needs="transmission",
    ),
    Setting(
        "Transparent Bounces",
        "cycles.transparent_max_bounces",
        MANY,
        _few,
        message(
            "render_settings.light-ends-behind-many",
            "light ends behind that many surfaces with alpha",
        ),
        needs="alpha",
    ),
    Setting(
        "Total Bounces",
        "cycles.max_bounces",
        MANY,
        _few,
        message(
            "render_settings.lose-picture-glass-white",
            "12 lose 1 to 2 % of a picture with glass, 5 % of a white room",
        ),
    ),
    Setting(
        "Diffuse Bounces",
        "cycles.diffuse_bounces",
        MANY,
        _few,
        message(
            "render_settings.lose-cornell-box-white",
            "4 lose 3 % of a Cornell box, 27 % of a white room",
        ),
    ),
    Setting(
        "Glossy Bounces",
        "cycles.glossy_bounces",
        MANY,
        _few,
        message("render_settings.lose-room-metal", "4 lose 26 % of a room of metal"),
    ),
    Setting(
        "Filter Glossy",
        "cycles.blur_glossy",
        0.0,
        _positive,
        message(
            "render_settings.loses-picture-glass-medium",
            "1 loses 2 to 4 % of a picture with glass, 10 % with a medium, 19 % of a room of metal",
        ),
    ),
    Setting(
        "Clamp Indirect",
        "cycles.sample_clamp_indirect",
        0.0,
        _positive,
        message(
            "render_settings.loses-picture-more-small",
            "10 loses 0.1 to 0.7 % of a picture, more with small bright lights",
        ),
    ),
    Setting(
        "Clamp Direct",
        "cycles.sample_clamp_direct",
        0.0,
        _positive,
        message("render_settings.cuts-highlights-off", "cuts highlights off"),
    ),
    Setting(
        "Reflective Caustics",
        "cycles.caustics_reflective",
        True,
        _off,
        message(
            "render_settings.without-both-caustics-picture",
            "without both caustics 6 to 8 % of a picture with glass are lost",
        ),
    ),
    Setting(
        "Refractive Caustics",
        "cycles.caustics_refractive",
        True,
        _off,
        message(
            "render_settings.without-both-caustics-picture",
            "without both caustics 6 to 8 % of a picture with glass are lost",
        ),
    ),
    Setting(
        "Fast GI Approximation",
        "cycles.use_fast_gi",
        False,
        _on,
        message(
            "render_settings.replaces-bounces-constant-half",
            "replaces bounces by a constant: half of a room's light",
        ),
    ),
    Setting(
        "Film Exposure",
        "cycles.film_exposure",
        1.0,
        lambda value: abs(value - 1) > 1e-6,
        message("render_settings.multiplies-whole-picture", "multiplies the whole picture"),
    ),
    Setting(
        "Denoise",
        "cycles.use_denoising",
        False,
        _on,
        message(
            "render_settings.smooths-what-photo-shows",
            "smooths what the photo shows sharp; brightness stays",
        ),
    ),
    Setting(
        "Light Threshold",
        "cycles.light_sampling_threshold",
        0.0,
        _positive,
        message(
            "render_settings.adds-noise-dim-light", "adds noise in dim light; brightness stays"
        ),
        remark=True,
    ),
    Setting(
        "Pixel Filter",
        "cycles.pixel_filter_type",
        "BOX",
        lambda value: value != "BOX",
        message(
            "render_settings.blurs-edges-about-pixel",
            "blurs edges by about a pixel; brightness stays",
        ),
        remark=True,
    ),
    Setting(
        "View Transform",
        "view_settings.view_transform",
        "Standard",
        lambda value: value not in {"Standard", "Raw"},
        message(
            "render_settings.shows-other-colours-on",
            "shows other colours on screen than the photo has; OpenEXR files are not touched",
        ),
        remark=True,
    ),
    # What follows cannot spoil a picture, or is told elsewhere; a comparison render needs it.
    Setting("", "cycles.device", "CPU"),
    Setting("", "cycles.use_adaptive_sampling", False),
    Setting("", "cycles.use_animated_seed", False),
    Setting("", "cycles.use_light_tree", True),
    Setting("", "cycles.time_limit", 0.0),
    Setting("", "cycles.sample_offset", 0),
    # Blue noise, the factory setting of 4.5, makes the errors of neighbours depend on each other.
    Setting("", "cycles.sampling_pattern", "TABULATED_SOBOL"),
    Setting("", "cycles.use_layer_samples", "IGNORE"),
    Setting("", "render.dither_intensity", 0.0),
    Setting("", "render.resolution_percentage", 100),
    Setting("", "render.use_border", False),
    Setting("", "render.use_compositing", False),
    Setting("", "render.use_sequencer", False),
    Setting("", "render.use_freestyle", False),
    Setting("", "render.use_multiview", False),
    Setting("", "render.use_motion_blur", False),
    Setting("", "display_settings.display_device", "sRGB"),
    Setting("", "view_settings.look", "None"),
    Setting("", "view_settings.exposure", 0.0),
    Setting("", "view_settings.gamma", 1.0),
)

_OFFSET = "Shadow Terminator Geometry Offset"
_OFFSET_COST = message(
    "render_settings.shifts-shadows-at-grazing",
    "shifts shadows at grazing light on coarse smooth meshes: 0.1 % on a coarse sphere",
)
_DISTRIBUTION = "Distribution"
_DISTRIBUTION_COST = message(
    "render_settings.blender-renders-random-walk",
    "Blender 3 renders it by a random walk; the fit renders GGX",
)


def set_comparison(scene: bpy.types.Scene, samples: int, seed: int = 0) -> None:
    """Makes the next render an unbiased estimate of what the materials say, box-filtered."""
    for setting in SETTINGS:
        _put(scene, setting.path, setting.value)
    scene.cycles.samples = samples
    scene.cycles.seed = seed
    for item in _shifted_objects(scene):
        hosts.shadow_terminator(item).shadow_terminator_geometry_offset = 0.0


def remarks(scene: bpy.types.Scene, contents: Contents) -> list[Remark]:
    """What of the scene's settings makes Cycles show something else than the fit; worst first.

    Cheap: it looks at `contents_of(scene)` and the settings only.
    """
    found = []
    for setting, value in _judged(scene, contents):
        texts = (
            setting_text(scene, setting.path, value),
            setting_text(scene, setting.path, setting.value),
        )
        found.append(Remark(setting.name, *texts, setting.cost, not setting.remark))
    if contents.random_walks:
        value = f"Multiscatter GGX in {', '.join(contents.random_walks)}"
        found.append(Remark(_DISTRIBUTION, value, "GGX", _DISTRIBUTION_COST, True))
    if contents.shifted:
        value = message(
            "render_settings.above-objects",
            "above 0 for {shifted} objects",
            shifted=contents.shifted,
        )
        found.append(Remark(_OFFSET, value, "0", _OFFSET_COST, False))
    return sorted(found, key=lambda item: not item.spoils)


def set_for_fit(scene: bpy.types.Scene) -> list[str]:
    """Sets what `remarks` says to spoil the picture, and the shadow offset; returns the names.

    Pixel filter, threshold and view transform stay: they are a matter of taste.
    """
    changed = []
    for setting, _ in _judged(scene, contents_of(scene)):
        if not setting.remark:
            _put(scene, setting.path, setting.value)
            changed.append(setting.name)
    for _, node in list(_random_walks(scene)):
        node.distribution = "GGX"
        changed.append(_DISTRIBUTION)
    for item in list(_shifted_objects(scene)):
        hosts.shadow_terminator(item).shadow_terminator_geometry_offset = 0.0
        changed.append(_OFFSET)
    return list(dict.fromkeys(changed))


def contents_of(scene: bpy.types.Scene) -> Contents:
    """Looks through the objects, the nodes of every material of the scene, and the world."""
    volume = transmission = alpha = False
    trees = [material.node_tree for material in _materials(scene) if material.use_nodes]
    if scene.world is not None and scene.world.use_nodes:
        trees.append(scene.world.node_tree)
    for tree in trees:
        for node in tree.nodes if tree is not None else ():
            if node.bl_idname.startswith("ShaderNodeOutput"):
                volume |= "Volume" in node.inputs and node.inputs["Volume"].is_linked
            transmission |= node.bl_idname in {"ShaderNodeBsdfGlass", "ShaderNodeBsdfRefraction"}
            transmission |= _used(node, ("Transmission Weight", "Transmission"), 0.0)
            transmission |= _used(node, ("Subsurface Weight", "Subsurface"), 0.0)
            alpha |= node.bl_idname == "ShaderNodeBsdfTransparent" or _used(node, ("Alpha",), 1.0)
    volume |= any(item.type == "VOLUME" for item in scene.objects)
    walks = tuple(material.name for material, _ in _random_walks(scene))
    shifted = sum(1 for _ in _shifted_objects(scene))
    return Contents(volume, transmission or volume, alpha, walks, shifted)


def _judged(scene: bpy.types.Scene, contents: Contents) -> Iterator[tuple[Setting, object]]:
    """The settings that this Blender has and that differ where it matters, with their values."""
    for setting in SETTINGS:
        value = _get(scene, setting.path)
        if value is None or setting.spoils is None or not setting.spoils(value):
            continue
        if not setting.needs or getattr(contents, setting.needs):
            yield setting, value


def _used(node: bpy.types.Node, names: tuple[str, ...], neutral: float) -> bool:
    """Whether an input of a Principled BSDF is linked or differs from its neutral value."""
    if node.bl_idname != "ShaderNodeBsdfPrincipled":
        return False
    sockets = [node.inputs[name] for name in names if name in node.inputs]
    return any(socket.is_linked or socket.default_value != neutral for socket in sockets)


def _materials(scene: bpy.types.Scene) -> list[bpy.types.Material]:
    used = {
        slot.material.name_full: slot.material
        for item in scene.objects
        for slot in item.material_slots
        if slot.material is not None
    }
    return list(used.values())


def _random_walks(scene: bpy.types.Scene) -> Iterator[tuple[bpy.types.Material, bpy.types.Node]]:
    """Principled BSDFs whose Multiscatter GGX is a stochastic walk: those of Blender 3."""
    if not hosts.is_version_3():
        return
    for material in _materials(scene):
        for node in material.node_tree.nodes if material.use_nodes else ():
            if getattr(node, "distribution", "") == "MULTI_GGX" and hosts.is_editable(material):
                yield material, node


def _shifted_objects(scene: bpy.types.Scene) -> Iterator[bpy.types.Object]:
    for item in scene.objects:
        if item.type != "MESH" or not hosts.is_editable(item):
            continue
        if hosts.shadow_terminator(item).shadow_terminator_geometry_offset > 0:
            yield item


def _get(scene: bpy.types.Scene, path: str) -> object:
    """The value, or None where this Blender has no such setting."""
    owner_path, _, name = path.rpartition(".")
    return getattr(scene.path_resolve(owner_path), name, None)


def _put(scene: bpy.types.Scene, path: str, value: object) -> None:
    """Sets what this Blender has; a word that it does not know (a sampling pattern) is left."""
    owner_path, _, name = path.rpartition(".")
    owner = scene.path_resolve(owner_path)
    if not hasattr(owner, name):
        return
    try:
        setattr(owner, name, value)
    except TypeError:
        if not isinstance(value, str):
            raise
