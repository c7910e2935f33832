# SPDX-License-Identifier: GPL-3.0-or-later
"""What is read from a Blender scene: numbers and names only, nothing of bpy.

Matrices are (4, 4) float64, column vectors, object to world. Lengths are Blender units, angles
radians, colours linear Rec. 709, pictures (height, width, 3) float32 with row 0 at the top.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import asdict, dataclass, field, replace

import numpy as np

from .. import parameters
from ..messages import remark
from ..parameters import Parameter, Values
from ..problems import Problem, Reason
from .closedness import Closedness
from .lens import CameraLens
from .shaders import Shader
from .texture_values import TextureValues

#: Weights by which a socket of one number takes a colour, in Blender and Cycles.
LUMINANCE = (0.2126729, 0.7151522, 0.0721750)


@dataclass(frozen=True)
class CameraValues:
    """A perspective or orthographic camera; `width`, `height` in pixels are the scene's. lens: that
    of an imported one."""

    name: str
    matrix: np.ndarray
    kind: str
    lens_mm: float
    sensor_width: float
    sensor_height: float
    sensor_fit: str
    shift_x: float
    shift_y: float
    ortho_scale: float
    clip_start: float
    clip_end: float
    pixel_aspect_x: float
    pixel_aspect_y: float
    width: int
    height: int
    lens: CameraLens | None = None

    @property
    def aspect(self) -> float:
        """Width over height; of no pixels, which is a problem of the scene, 1."""
        return self.width / self.height if self.width > 0 and self.height > 0 else 1.0


@dataclass(frozen=True)
class MeshValues:
    """Triangles in object space: positions (n, 3), triangles (m, 3), corner_normals (3m, 3),
    material_slots (m,). UV maps (3m, 2) and linear colour attributes (3m, 3) have names; the one
    that renders by default comes first. `stored_colors`: of those attributes the values of the
    user's mesh, (n, 3) one for each vertex or corner, and which of them each corner shows, (3m,);
    none where modifiers make another mesh. `own_vertices`: whether the positions are those of
    the user's mesh, without modifiers. `other_attributes`: names of what is not read. `vectors`:
    (3m, 3) made for shaders, by their names."""

    name: str
    positions: np.ndarray
    triangles: np.ndarray
    corner_normals: np.ndarray
    material_slots: np.ndarray
    uv_maps: tuple[tuple[str, np.ndarray], ...] = ()
    colors: tuple[tuple[str, np.ndarray], ...] = ()
    other_attributes: tuple[str, ...] = ()
    vectors: tuple[tuple[str, np.ndarray], ...] = ()
    stored_colors: tuple[tuple[str, np.ndarray, np.ndarray], ...] = ()
    own_vertices: bool = True


SCATTERED_RAYS = ("diffuse", "glossy", "transmission", "volume_scatter")
ALL_RAYS = ("camera", *SCATTERED_RAYS, "shadow")
ALL_SETS = 2**64 - 1
NO_LIMIT = 2**31 - 1


@dataclass(frozen=True)
class ObjectFacts:
    """What a shader may ask about an object; `index`: its pass index."""

    location: Values = (0.0, 0.0, 0.0)
    color: Values = (1.0, 1.0, 1.0)
    alpha: float = 1.0
    index: float = 0.0
    random: float = 0.0


@dataclass(frozen=True)
class ObjectValues:
    """One mesh at one place; `materials[i]` is the name of the material of slot i.

    `visible_to`: the kinds of rays that see it, of ALL_RAYS. `lit_set`, `shadow_set`: its sets of
    light and shadow linking; `lit`: bits of the lit_sets that its own emission shines on.
    """

    name: str
    mesh: int
    matrix: np.ndarray
    materials: tuple[str, ...]
    visible_to: tuple[str, ...] = ALL_RAYS
    holdout: bool = False
    lit_set: int = 0
    shadow_set: int = 0
    lit: int = ALL_SETS
    facts: ObjectFacts = field(default_factory=ObjectFacts)

    @property
    def visible_to_camera(self) -> bool:
        """Whether photos show it, as it is."""
        return "camera" in self.visible_to and not self.holdout


@dataclass(frozen=True, eq=False)
class MapValues:
    """Where a parameter comes from that is not constant: a texture, or a colour attribute if None.

    `attribute`: UV map or colour attribute, "" for the one that renders by default. `uv`: (2, 3),
    applied to (u, v, 1). `grey`: "luminance" or "mean", which a socket on the way puts into all
    channels, or ""; a texture's pixels have it already.
    """

    texture: TextureValues | None
    attribute: str
    uv: np.ndarray = field(default_factory=lambda: np.eye(2, 3, dtype=np.float32))
    grey: str = ""

    @property
    def called(self) -> str:
        """The attribute as the native scene knows it, with what becomes of it."""
        return f"{self.attribute} ({self.grey})" if self.grey else self.attribute


def greyed(colors: np.ndarray, grey: str) -> np.ndarray:
    """(..., 3) linear colours with their luminance or mean in all channels, as float32."""
    weights = np.array(LUMINANCE if grey == "luminance" else (1 / 3,) * 3)
    number = np.asarray(colors, np.float64) @ weights
    return np.repeat(number[..., None], 3, axis=-1).astype(np.float32)


@dataclass(frozen=True, eq=False)
class GridValues:
    """Numbers or colours over a box: values (nz, ny, nx, 1 or 3) float32, and `to_unit` (4, 4),
    world to the unit cube over which they lie; voxel i of n has its centre at (i + 1/2) / n."""

    name: str
    values: np.ndarray
    to_unit: np.ndarray


@dataclass(frozen=True)
class MaterialValues:
    """Values of a Principled BSDF by parameter name; a parameter in `maps` varies instead.

    `grids` of the medium: "albedo" in place of the constant, "density" times the extinction.
    `shader`: what the surface is made of in place of the Principled BSDF.
    """

    name: str
    values: dict[str, Values]
    multi_ggx: bool
    flavour: str
    subsurface: str = "RANDOM_WALK"
    maps: dict[str, MapValues] = field(default_factory=dict)
    grids: dict[str, GridValues] = field(default_factory=dict)
    transparent_shadows: bool = True
    shader: Shader | None = None


@dataclass(frozen=True)
class LightValues:
    """A lamp at one place; one that stands at several is several of these, with one name, power and
    colour. `shape` holds the arguments that only this kind of lamp has. `object`: what places it.
    `normalized`: its power is shared out over its area, else `radiance_scale` holds the area.

    `visible_to`: the kinds of rays that see it. `met_by_rays`: not only light sampling finds it.
    `max_bounces`: after more of them light sampling passes it over. `lit`, `shading`: bits of the
    lit_sets that it shines on, and of the shadow_sets that cast its shadows.
    """

    name: str
    kind: str
    matrix: np.ndarray
    power: float
    color: Values
    radiance_scale: float
    light_units: str
    shape: dict[str, float | bool | str]
    object: str = ""
    normalized: bool = True
    visible_to: tuple[str, ...] = SCATTERED_RAYS
    casts_shadows: bool = True
    met_by_rays: bool = True
    max_bounces: int = NO_LIMIT
    lit: int = ALL_SETS
    shading: int = ALL_SETS


@dataclass(frozen=True)
class LampFrame:
    """Lamps at another frame of the scene: `places`, object to world by object, of those that
    render then. `problems`: what else is different there; `warnings`: what may be."""

    places: dict[str, np.ndarray]
    problems: tuple[Problem, ...] = ()
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class SunValues:
    """The disc of a sun in a panorama, in the frame of that image: axis (3,) and direction to the
    top of its picture, up (3,), radius in radians, picture (n, n, 3) of all within the radius."""

    axis: np.ndarray
    up: np.ndarray
    radius: float
    picture: np.ndarray

    @property
    def arguments(self) -> tuple[np.ndarray, np.ndarray, float, np.ndarray]:
        """As the native scene takes it."""
        return self.axis, self.up, self.radius, self.picture


@dataclass(frozen=True, eq=False)
class BackdropValues:
    """What the background is to rays of exactly these kinds. `scaled`: times its colour and
    strength. The rest is as of WorldValues."""

    kinds: tuple[str, ...]
    image: np.ndarray
    to_map: np.ndarray
    scaled: bool
    sun: SunValues | None = None


@dataclass(frozen=True)
class WorldValues:
    """Background: colour (a tint if there is an image) times strength.

    `to_map` (3, 3): direction in the image's frame = to_map @ direction in the world. `rotation`:
    what of it is one about Z that can be fitted, radians; it comes last.
    `visible_to`, `max_bounces`: as of a lamp. `transparent_film`: the camera does not see it, nor
    through glass up to `film_roughness`, unless that is negative. `sun` adds to the image.
    `backdrops`: of the rays that see another background.
    """

    color: Values = (0.0, 0.0, 0.0)
    strength: float = 0.0
    image: np.ndarray | None = None
    to_map: np.ndarray = field(default_factory=lambda: np.eye(3))
    rotation: float = 0.0
    visible_to: tuple[str, ...] = ALL_RAYS
    max_bounces: int = NO_LIMIT
    transparent_film: bool = False
    film_roughness: float = -1.0
    sun: SunValues | None = None
    backdrops: tuple[BackdropValues, ...] = ()


@dataclass(frozen=True)
class Owner:
    """Who owns parameters: a material, a light or the world; of a mesh, an object.

    `values`: what Blender has now. `fixed`: parameter -> why it cannot be fitted. `datablock`: its
    name in the .blend; `name` differs from it only where two owners would have the same name.
    `parameters`: those of this owner alone, the constants of its shader; `usual`: which of them are
    fitted unless others are asked for.
    """

    name: str
    kind: str
    datablock: str
    library: str
    values: dict[str, Values]
    fixed: dict[str, Reason]
    parameters: dict[str, Parameter] = field(default_factory=dict)
    usual: tuple[str, ...] = ()

    def rows(self) -> list[Parameter]:
        """Its own parameters, and those of every owner of its kind."""
        return [*self.parameters.values(), *parameters.of(self.kind)]

    def listed(self) -> list[Parameter]:
        """`rows` without what its kind has and it has not: a graph is no Principled BSDF."""
        if not self.parameters:
            return self.rows()
        return [row for row in self.rows() if row.name in self.values]

    def find(self, name: str) -> Parameter | None:
        """One of `rows`, None if there is none of that name."""
        return self.parameters.get(name) or parameters.table().get((self.kind, name))


@dataclass(frozen=True)
class BodyValues:
    """What was counted for the faces of one object that have to be closed, and why they have to:
    `need` is "medium", "glass" or "subsurface". `fault`: the problem or warning, "" for none.
    """

    object: str
    material: str
    need: str
    found: Closedness
    fault: str = ""

    def as_json(self) -> dict[str, object]:
        """Keys object, material, need, closed, fault, and the counts of Closedness."""
        return {
            "object": self.object,
            "material": self.material,
            "need": self.need,
            "closed": self.found.encloses,
            "fault": self.fault,
            **asdict(self.found),
        }


@dataclass
class SceneValues:
    """Everything that was read, with what stands in the way of rendering it.

    millimetres: in one Blender unit, None where the scene has no system of units.
    camera_problems: those of `problems` that keep nothing but a camera from being there.
    physical_refraction: rough refraction towards lights only where a micronormal connects both
    directions; Cycles evaluates it for every pair (docs/method/rendering.md).
    approximate: what Cycles shows otherwise is warned of where it can be rendered.
    """

    cameras: list[CameraValues] = field(default_factory=list)
    meshes: list[MeshValues] = field(default_factory=list)
    objects: list[ObjectValues] = field(default_factory=list)
    materials: list[MaterialValues] = field(default_factory=list)
    lights: list[LightValues] = field(default_factory=list)
    world: WorldValues = field(default_factory=WorldValues)
    owners: dict[str, Owner] = field(default_factory=dict)
    bodies: list[BodyValues] = field(default_factory=list)
    lamp_frames: dict[int, LampFrame] = field(default_factory=dict)
    millimetres: float | None = None
    physical_refraction: bool = False
    approximate: bool = False
    unusable_cameras: dict[str, str] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)
    camera_problems: list[Problem] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)

    def object_owners(self) -> list[Owner]:
        """Objects as owners of what belongs to their meshes. They are not among `owners`: a
        material may be called as its object is."""
        names = dict.fromkeys(item.name for item in self.objects)
        return [Owner(name, "object", name, "", {}, {}) for name in names]

    def warn(self, text: str) -> None:
        """Keeps a warning once."""
        if text not in self.warnings:
            self.warnings.append(text)

    def refuse(self, problem: Problem) -> None:
        """Keeps a problem of what Cycles shows otherwise: where that may be, a warning of it."""
        if self.approximate:
            self.warn(remark(problem.object, f"{problem.cause}; it is rendered nevertheless"))
        elif problem not in self.problems:
            self.problems.append(problem)

    def without_shut(self, fitted: Collection[tuple[str, str]]) -> SceneValues:
        """The same picture for less, while `fitted` alone change, by owner and parameter."""
        materials = [
            replace(
                item,
                shader=item.shader.without_shut({name for of, name in fitted if of == item.name}),
            )
            if item.shader is not None
            else item
            for item in self.materials
        ]
        return replace(self, materials=materials)

    def triangle_count(self) -> int:
        """Triangles that are rendered, instances counted."""
        return sum(len(self.meshes[item.mesh].triangles) for item in self.objects)
