# SPDX-License-Identifier: GPL-3.0-or-later
"""The types of the native module: scenes, renderer and fit.

`tests/python/test_native_stubs.py` compares names and parameters with the module. What a dict of
the module holds is a TypedDict here.
"""

from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import ClassVar, TypedDict, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: str
few_unknowns: int

# (aspect, width, height), and of a crop its window (left, top, right, bottom)
Frame = tuple[float, int, int] | tuple[float, int, int, Sequence[float]]
Floats = NDArray[np.float64]

class ParameterRow(TypedDict):
    owner: str
    name: str
    sockets: list[str]
    unit: str
    width: int
    lower: float
    upper: float
    fit_lower: float
    fit_upper: float
    initial: float
    scale: str
    effect: str
    versions: list[str]
    help: str

class LossRow(TypedDict):
    name: str
    title: str
    help: str
    least_spp: int

class OptimiserRow(TypedDict):
    name: str
    help: str
    least_spp: int

class ProbeColumn(TypedDict):
    name: str
    lower: float
    upper: float
    required: bool
    parameter: bool

class SettingRanges(TypedDict):
    fit: dict[str, tuple[float, float]]
    render: dict[str, tuple[float, float]]

class PlannedRenders(TypedDict):
    phase: str
    pixels: int
    spp: int
    renders: float
    derivatives: str

class Reparametrization(TypedDict):
    names: list[str]
    slope: NDArray[np.float64]
    range: NDArray[np.float64]

class ClosureValues(TypedDict):
    kind: str
    inputs: dict[str, NDArray[np.float64]]
    weight: NDArray[np.float64] | None
    normal: NDArray[np.float64] | None
    tangent: NDArray[np.float64] | None

class Problem:
    @property
    def object(self) -> str: ...
    @property
    def cause(self) -> str: ...
    @property
    def cure(self) -> str: ...

class Cancelled(RuntimeError): ...

class ProgressToken:
    def __init__(self) -> None: ...
    def cancel(self) -> None: ...
    @property
    def fraction(self) -> float: ...

class Film:
    @property
    def image(self) -> NDArray[np.float32]: ...
    @property
    def standard_error(self) -> NDArray[np.float32]: ...
    @property
    def half_a(self) -> NDArray[np.float32]: ...
    @property
    def half_b(self) -> NDArray[np.float32]: ...
    @property
    def unknowns(self) -> list[tuple[str, str, int]]: ...
    @property
    def jacobian(self) -> NDArray[np.float32]: ...
    @property
    def jacobian_standard_error(self) -> NDArray[np.float32]: ...
    @property
    def covariance(self) -> NDArray[np.float32]: ...
    @property
    def dropped(self) -> int: ...
    @property
    def first_dropped(self) -> str: ...
    @property
    def truncated(self) -> int: ...
    @property
    def lanes(self) -> int: ...
    @property
    def vertices(self) -> int: ...
    @property
    def exits(self) -> int: ...
    @property
    def spp(self) -> int: ...
    @property
    def seconds(self) -> float: ...
    @property
    def cpu_seconds(self) -> float: ...

class Scene:
    @property
    def cameras(self) -> list[str]: ...
    @property
    def materials(self) -> list[str]: ...
    @property
    def lights(self) -> list[str]: ...
    @property
    def light_objects(self) -> list[str]: ...
    @property
    def objects(self) -> list[str]: ...
    @property
    def triangle_count(self) -> int: ...
    @property
    def dropped_triangles(self) -> dict[str, int]: ...
    def get(self, owner: str, parameter: str) -> NDArray[np.float64]: ...
    def with_values(self, values: Mapping[tuple[str, str], ArrayLike]) -> Scene: ...
    def with_lights(self, lights: Mapping[str, object]) -> Scene: ...
    def with_environment(self, pixels: ArrayLike) -> Scene: ...
    def with_grid(self, material: str, use: str, values: ArrayLike) -> Scene: ...
    def with_image(self, material: str, pixels: ArrayLike, parameter: str = ...) -> Scene: ...
    def with_vertex_colors(self, object: str, colors: ArrayLike) -> Scene: ...
    def vertices(self, object: str) -> NDArray[np.float32]: ...
    def with_vertices(self, object: str, positions: ArrayLike) -> Scene: ...
    def shader_values(
        self,
        material: str,
        camera: str,
        width: int,
        height: int,
        by: str = "",
        places: ArrayLike | None = None,
    ) -> list[ClosureValues]: ...
    def shader_constants(self, material: str) -> list[ParameterRow]: ...
    def project(
        self, camera: str, width: int, height: int, points: ArrayLike
    ) -> NDArray[np.float64]: ...

class SceneBuilder:
    def __init__(self) -> None: ...
    def add_mesh(
        self,
        name: str,
        positions: ArrayLike,
        triangles: ArrayLike,
        corner_normals: ArrayLike,
        material_slots: ArrayLike,
        uv_maps: Sequence[tuple[str, ArrayLike]] = ...,
        colors: Sequence[tuple[str, ArrayLike]] = ...,
        vectors: Sequence[tuple[str, ArrayLike]] = ...,
        stored_colors: Mapping[str, tuple[ArrayLike, ArrayLike]] = ...,
    ) -> int: ...
    def add_object(
        self,
        name: str,
        mesh: int,
        matrix: ArrayLike,
        materials: Sequence[int],
        *,
        visible_to: Sequence[str] = ...,
        holdout: bool = False,
        lit_set: int = 0,
        shadow_set: int = 0,
        lit: int = ...,
        facts: Mapping[str, object] | None = None,
    ) -> int: ...
    def add_texture(
        self,
        name: str,
        pixels: ArrayLike,
        *,
        encoded: bool,
        extension: str = "REPEAT",
        interpolation: str = "Linear",
    ) -> int: ...
    def add_material(
        self,
        name: str,
        values: Mapping[str, object],
        *,
        multi_ggx: bool = True,
        flavour: str = "v2",
        subsurface: str = "RANDOM_WALK",
        physical_refraction: bool = False,
        transparent_shadows: bool = True,
        maps: Mapping[str, Mapping[str, object]] = ...,
        grids: Mapping[str, Mapping[str, object]] = ...,
        shader: Mapping[str, object] | None = None,
    ) -> int: ...
    def add_point_light(
        self,
        name: str,
        matrix: ArrayLike,
        power: float,
        color: ArrayLike,
        radius: float,
        soft_falloff: bool,
        *,
        light_units: str = "v4",
        radiance_scale: float = 1.0,
    ) -> int: ...
    def add_sun_light(
        self,
        name: str,
        matrix: ArrayLike,
        strength: float,
        color: ArrayLike,
        angle: float,
        *,
        light_units: str = "v4",
        radiance_scale: float = 1.0,
    ) -> int: ...
    def add_spot_light(
        self,
        name: str,
        matrix: ArrayLike,
        power: float,
        color: ArrayLike,
        radius: float,
        soft_falloff: bool,
        size: float,
        blend: float,
        *,
        light_units: str = "v4",
        radiance_scale: float = 1.0,
    ) -> int: ...
    def add_area_light(
        self,
        name: str,
        matrix: ArrayLike,
        power: float,
        color: ArrayLike,
        shape: str,
        size_x: float,
        size_y: float,
        spread: float,
        *,
        light_units: str = "v4",
        radiance_scale: float = 1.0,
    ) -> int: ...
    def set_light_object(self, light: int, object: str) -> None: ...
    def set_light_visibility(
        self,
        light: int,
        visible_to: Sequence[str],
        *,
        casts_shadows: bool,
        met_by_rays: bool,
        max_bounces: int,
        lit: int = ...,
        shading: int = ...,
    ) -> None: ...
    def set_world(
        self,
        color: ArrayLike,
        strength: float,
        image: ArrayLike | None = None,
        to_map: ArrayLike = ...,
        rotation: float = 0.0,
        sun: tuple[ArrayLike, ArrayLike, float, ArrayLike] | None = None,
    ) -> None: ...
    def add_backdrop(
        self,
        seen_by: Sequence[str],
        image: ArrayLike,
        to_map: ArrayLike,
        scaled: bool,
        sun: tuple[ArrayLike, ArrayLike, float, ArrayLike] | None = None,
    ) -> None: ...
    def set_world_visibility(
        self,
        visible_to: Sequence[str],
        *,
        max_bounces: int,
        transparent_film: bool,
        film_roughness: float,
    ) -> None: ...
    def add_camera(
        self,
        name: str,
        matrix: ArrayLike,
        kind: str,
        lens_mm: float,
        sensor_width: float,
        sensor_height: float,
        sensor_fit: str,
        shift_x: float,
        shift_y: float,
        ortho_scale: float,
        clip_start: float,
        clip_end: float,
        pixel_aspect_x: float = 1.0,
        pixel_aspect_y: float = 1.0,
    ) -> int: ...
    def build(self) -> Scene: ...

class Photo:
    def __init__(
        self,
        camera: str,
        reference: NDArray[np.float32] | None = None,
        weight: NDArray[np.float32] | None = None,
        *,
        size: Sequence[int] | None = None,
        id: str = "",
        frame: Frame = (0.0, 0, 0),
        lights: Mapping[str, object] | None = None,
        gain: Sequence[float] = ...,
        free_gain: str = "none",
        align: bool = False,
        alignment: Sequence[float] = ...,
        coverage: NDArray[np.float32] | None = None,
    ) -> None: ...
    @property
    def id(self) -> str: ...
    @property
    def camera(self) -> str: ...
    @property
    def reference(self) -> NDArray[np.float32]: ...
    @property
    def weight(self) -> NDArray[np.float32]: ...
    @property
    def frame(self) -> Frame: ...
    @property
    def size(self) -> list[int]: ...
    @property
    def gain(self) -> list[float]: ...
    @property
    def alignment(self) -> list[float]: ...

class Unknown:
    def __init__(
        self,
        owner: str,
        parameter: str,
        minimum: float,
        maximum: float,
        start: float | Sequence[float] = ...,
        learning_rate: float = 0.03,
    ) -> None: ...
    @property
    def owner(self) -> str: ...
    @property
    def parameter(self) -> str: ...
    @property
    def start(self) -> list[float]: ...
    @property
    def minimum(self) -> float: ...
    @property
    def maximum(self) -> float: ...
    @property
    def learning_rate(self) -> float: ...

class PhotoJacobian:
    @property
    def image(self) -> NDArray[np.float32]: ...
    @property
    def variance(self) -> NDArray[np.float32]: ...
    @property
    def jacobian_a(self) -> NDArray[np.float32]: ...
    @property
    def jacobian_b(self) -> NDArray[np.float32]: ...
    @property
    def dropped(self) -> int: ...
    @property
    def spp(self) -> int: ...
    @property
    def not_finite(self) -> list[str]: ...
    def join(self, other: PhotoJacobian) -> None: ...

class FisherInformation:
    @property
    def normal(self) -> NDArray[np.float64]: ...
    @property
    def normal_variance(self) -> NDArray[np.float64]: ...
    @property
    def score_covariance(self) -> NDArray[np.float64]: ...
    @property
    def low(self) -> float: ...
    @property
    def high(self) -> float: ...
    def relative_uncertainty(self) -> float: ...
    def precision(self, resolved: float = 3.0) -> NDArray[np.float64]: ...

class Evaluator:
    def __init__(
        self, scene: Scene, *, depth: int = 0, threads: int = 0, lanes: int = 0
    ) -> None: ...
    def picture(
        self,
        photo: Photo,
        spp: int,
        *,
        seed: int = 0,
        parameters: Sequence[tuple[str, str]] = ...,
        progress: ProgressToken | None = None,
    ) -> Film: ...
    def jacobian(
        self,
        photo: Photo,
        unknowns: Sequence[Unknown],
        spp: int,
        *,
        seed: int = 0,
        progress: ProgressToken | None = None,
    ) -> PhotoJacobian: ...
    def gradient(
        self,
        photo: Photo,
        owner: str,
        parameter: str,
        spp: int,
        *,
        loss: str = "mean",
        seed: int = 0,
        progress: ProgressToken | None = None,
    ) -> tuple[Film, NDArray[np.float64]]: ...
    def misfit(
        self, photo: Photo, spp: int, *, seed: int = 0, progress: ProgressToken | None = None
    ) -> float: ...

class StopReason:
    NONE: ClassVar[StopReason]
    ITERATIONS: ClassVar[StopReason]
    CONVERGED: ClassVar[StopReason]
    TOLERANCE: ClassVar[StopReason]
    CANCELLED: ClassVar[StopReason]
    DROPPED: ClassVar[StopReason]
    ERROR: ClassVar[StopReason]
    __members__: ClassVar[Mapping[str, StopReason]]
    def __init__(self, value: int) -> None: ...
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...
    def __int__(self) -> int: ...
    def __index__(self) -> int: ...

class Progress:
    @property
    def running(self) -> bool: ...
    @property
    def done(self) -> bool: ...
    @property
    def problems(self) -> list[Problem]: ...
    @property
    def stopped(self) -> StopReason: ...
    @property
    def stopped_because(self) -> str: ...
    @property
    def stage(self) -> int: ...
    @property
    def iteration(self) -> int: ...
    @property
    def own_iteration(self) -> int: ...
    @property
    def iterations(self) -> int: ...
    @property
    def phase(self) -> str: ...
    @property
    def phase_fraction(self) -> float: ...
    @property
    def loss(self) -> float: ...
    @property
    def validation(self) -> float: ...
    @property
    def validation_standard_error(self) -> float: ...
    @property
    def seconds(self) -> float: ...
    @property
    def seconds_left(self) -> float: ...
    @property
    def values(self) -> dict[str, list[float]]: ...

class ParameterConfidence:
    @property
    def standard_error(self) -> list[float]: ...
    @property
    def interval_90(self) -> list[tuple[float, float]]: ...
    @property
    def determined(self) -> list[bool]: ...
    @property
    def at_bound(self) -> list[str | None]: ...
    @property
    def correlated_with(self) -> list[str | None]: ...
    @property
    def samples_factor(self) -> list[float]: ...

class Misfit:
    @property
    def value(self) -> float: ...
    @property
    def standard_error(self) -> float: ...
    @property
    def explained(self) -> bool: ...

class WeakDirection:
    @property
    def deviation(self) -> float: ...
    @property
    def components(self) -> list[str]: ...
    @property
    def captures(self) -> list[str]: ...

class TrustReport:
    @property
    def parameters(self) -> dict[str, ParameterConfidence]: ...
    @property
    def passes(self) -> int: ...
    @property
    def spp(self) -> int: ...
    @property
    def misfit(self) -> Misfit: ...
    @property
    def alternative_minima(self) -> list[dict[str, list[float]]]: ...
    @property
    def ambiguous(self) -> list[str]: ...
    @property
    def weak_directions(self) -> list[WeakDirection]: ...

class FoundPhoto:
    @property
    def residual_rms(self) -> float: ...
    @property
    def unexplained(self) -> float: ...
    @property
    def shift(self) -> tuple[float, float, float] | None: ...
    @property
    def gain(self) -> tuple[float, float, float] | None: ...
    @property
    def gain_interval_90(self) -> list[tuple[float, float]] | None: ...

class History:
    @property
    def iteration(self) -> NDArray[np.int32]: ...
    @property
    def loss(self) -> Floats: ...
    @property
    def validation(self) -> Floats: ...
    @property
    def validation_standard_error(self) -> Floats: ...
    @property
    def mean_bias(self) -> Floats: ...
    @property
    def values(self) -> dict[str, Floats]: ...
    @property
    def field_means(self) -> dict[str, Floats]: ...
    @property
    def stage(self) -> NDArray[np.int32] | None: ...

class FoundStage:
    @property
    def name(self) -> str: ...
    @property
    def parameters(self) -> list[str]: ...
    @property
    def iterations(self) -> int: ...
    @property
    def spp(self) -> int: ...
    @property
    def height(self) -> int: ...
    @property
    def best_iteration(self) -> int: ...
    @property
    def stopped_because(self) -> str: ...
    @property
    def samples(self) -> int: ...
    @property
    def seconds(self) -> float: ...
    @property
    def cpu_seconds(self) -> float: ...
    @property
    def values(self) -> dict[str, list[float]]: ...

class Search:
    @property
    def points(self) -> int: ...
    @property
    def moved(self) -> bool: ...
    @property
    def start_loss(self) -> float: ...
    @property
    def loss(self) -> float: ...
    @property
    def standard_error(self) -> float: ...

class ShapeSteps:
    @property
    def turning(self) -> int: ...
    @property
    def intersecting(self) -> int: ...
    @property
    def given_up(self) -> int: ...

class ModelError:
    @property
    def relative(self) -> float: ...
    @property
    def absolute(self) -> float: ...
    @property
    def shift(self) -> float: ...

class FieldPattern:
    @property
    def explained(self) -> float: ...
    @property
    def left(self) -> float: ...

class FitResult:
    @property
    def values_last(self) -> dict[str, list[float]]: ...
    @property
    def values_best(self) -> dict[str, list[float]]: ...
    @property
    def fields_last(self) -> dict[str, NDArray[np.float32]]: ...
    @property
    def fields_best(self) -> dict[str, NDArray[np.float32]]: ...
    @property
    def best_iteration(self) -> int: ...
    @property
    def best_validation(self) -> float: ...
    @property
    def best_validation_standard_error(self) -> float: ...
    @property
    def start_validation(self) -> float: ...
    @property
    def captures(self) -> dict[str, FoundPhoto]: ...
    @property
    def kept_start(self) -> bool: ...
    @property
    def model_error(self) -> ModelError: ...
    @property
    def iterations(self) -> int: ...
    @property
    def stopped(self) -> StopReason: ...
    @property
    def stopped_because(self) -> str: ...
    @property
    def problems(self) -> list[Problem]: ...
    @property
    def optimiser(self) -> str: ...
    @property
    def samples(self) -> int: ...
    @property
    def dropped(self) -> int: ...
    @property
    def cpu_seconds(self) -> float: ...
    @property
    def seconds(self) -> float: ...
    @property
    def search(self) -> Search: ...
    @property
    def patterns(self) -> dict[str, FieldPattern]: ...
    @property
    def shape_steps(self) -> ShapeSteps: ...
    @property
    def report(self) -> TrustReport: ...
    @property
    def history(self) -> History: ...
    @property
    def stages(self) -> list[FoundStage] | None: ...

class Stage:
    def __init__(
        self,
        name: str,
        parameters: Sequence[str],
        fields: Sequence[str],
        scene: Scene,
        photos: Sequence[Photo],
        settings: Mapping[str, object],
    ) -> None: ...

class WrittenState:
    @property
    def file(self) -> Path: ...
    @property
    def seconds(self) -> float: ...

class Fit:
    @overload
    def __init__(
        self,
        scene: Scene,
        photos: Sequence[Photo],
        unknowns: Sequence[Unknown],
        settings: Mapping[str, object] = ...,
        *,
        workers: object = None,
    ) -> None: ...
    @overload
    def __init__(
        self,
        unknowns: Sequence[Unknown],
        *,
        stages: Sequence[Stage],
        workers: object = None,
    ) -> None: ...
    def start(self) -> None: ...
    def cancel(self) -> None: ...
    def join(self) -> None: ...
    def request_state(self, file: str | PathLike[str]) -> None: ...
    def take_state(self) -> WrittenState | None: ...
    def restore(self, file: str | PathLike[str], seconds: float = 0.0) -> None: ...
    def progress(self) -> Progress: ...
    def preview(self, photo_index: int) -> NDArray[np.float32] | None: ...
    def history(self, of_stage: bool = False) -> History: ...
    def result(self, *, fields: bool = True) -> FitResult: ...

class StageWorker:
    def __init__(
        self, unknowns: Sequence[Unknown], stages: Sequence[Stage], *, threads: int = 0
    ) -> None: ...
    def answer(self, question: bytes) -> bytes: ...

def parameters() -> list[ParameterRow]: ...
def closures() -> dict[str, list[ParameterRow]]: ...
def losses() -> list[LossRow]: ...
def optimisers() -> list[OptimiserRow]: ...
def setting_ranges() -> SettingRanges: ...
def refinement_spp(settings: Mapping[str, object]) -> int: ...
def schedule(
    scene: Scene,
    photos: Sequence[tuple[str, str, int, int]],
    unknowns: Sequence[Unknown],
    settings: Mapping[str, object],
) -> list[PlannedRenders]: ...
def render(
    scene: Scene,
    camera: str,
    width: int,
    height: int,
    spp: int,
    *,
    seed: int = 0,
    depth: int = 0,
    threads: int = 0,
    frame: Frame = (0.0, 0, 0),
    lanes: int = 0,
    parameters: Sequence[tuple[str, str]] = ...,
    progress: ProgressToken | None = None,
) -> Film: ...
def decide_aims(
    scene: Scene,
    camera: str,
    width: int,
    height: int,
    *,
    depth: int = 0,
    threads: int = 0,
    frame: Frame = (0.0, 0, 0),
    parameters: Sequence[tuple[str, str]] = ...,
) -> Scene: ...
def aimed_lamps(scene: Scene) -> list[str]: ...
def with_aimed_lamps(scene: Scene, objects: Sequence[str]) -> Scene: ...
def has_lanes() -> bool: ...
def lanes_obstacle(scene: Scene) -> str: ...
def first_hits(scene: Scene, starts: ArrayLike, ends: ArrayLike) -> NDArray[np.int32]: ...
def reparametrization(scene: Scene, unknowns: Sequence[Unknown]) -> Reparametrization: ...
def fisher_information(
    seen: PhotoJacobian,
    picture: ArrayLike | None = None,
    weight: ArrayLike | None = None,
    *,
    spp: float,
    relative: float,
    pixels: float,
    model_error: Sequence[float] = ...,
) -> FisherInformation: ...
def weakest_direction(photos: Sequence[FisherInformation]) -> float: ...
def expected_errors(precisions: Sequence[ArrayLike], ranges: ArrayLike) -> NDArray[np.float64]: ...
def determined(errors: ArrayLike, ranges: ArrayLike) -> NDArray[np.bool_]: ...
def information_gain(
    before: ArrayLike, after: ArrayLike, groups: Sequence[Sequence[int]]
) -> float: ...
def probe_columns(version: str) -> list[ProbeColumn]: ...
def probe(
    version: str,
    columns: Sequence[str],
    numbers: ArrayLike,
    multi_ggx: ArrayLike,
    *,
    precision: str = "double",
) -> NDArray[np.float64]: ...
def probe_slopes(
    version: str,
    columns: Sequence[str],
    numbers: ArrayLike,
    multi_ggx: ArrayLike,
    *,
    precision: str = "double",
) -> NDArray[np.float64]: ...
