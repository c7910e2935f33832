# SPDX-License-Identifier: GPL-3.0-or-later
"""The world: a Background node with a constant colour or an Environment Texture, and whatever
else Cycles evaluates to panoramas."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import bpy
import numpy as np

from ... import parameters
from ...messages import remark, thing
from ...parameters import Values
from ...problems import Problem, Reason
from ..values import BackdropValues, Owner, WorldValues
from . import images, nodes, panorama
from .coordinates import read_coordinates
from .nodes import Groups, Output, Source, Unreadable
from .panorama import LIGHT, Panorama, Rays

WORLD = "World"  # the owner's name, whatever the datablock is called
#: Of its image among what can be fixed.
ENVIRONMENT = "environment"
ROTATION = "rotation"
_FORWARD = ("POINT", "VECTOR")
_CURE = "use a Background node with a colour or an equirectangular Environment Texture"
#: Radiance of an image beyond which Cycles, which squares it, shows all surfaces black: with bpy
#: 4.5 1e17 is right still, 1e19 is black.
_BRIGHTEST = 1e17
_NOTHING = Reason("nothing is linked to the Surface of the world's output", "link a Background")


@dataclass(frozen=True, eq=False)
class Evaluated:
    """What Cycles has made of a world, by name of the rays that see it; or why it has not."""

    panoramas: Mapping[str, Panorama] = field(default_factory=dict)
    problem: Problem | None = None


def evaluate(scene: bpy.types.Scene, world: bpy.types.World | None) -> Evaluated:
    """What `read_world` needs. It renders: nothing else may render meanwhile."""
    if world is None or not world.use_nodes or world.node_tree is None:
        return Evaluated()
    title = thing("World", world.name)
    if _is_empty(world):
        return Evaluated()
    try:
        views = _views(world, title)
        wanted = [(view.rays, view.background) for view in views if view.is_evaluated]
        if not wanted or bpy.app.is_job_running("RENDER"):
            return Evaluated()
        return Evaluated(panorama.evaluate(scene, world, wanted, _output(world, title), title))
    except Unreadable as error:
        return Evaluated(problem=error.problem)


def read_world(
    world: bpy.types.World | None, evaluated: Evaluated
) -> tuple[WorldValues, Owner | None, list[Problem], list[str]]:
    """Values, owner, problems, warnings. Without a world the background is black."""
    if world is None:
        return WorldValues(), None, [], []
    title = thing("World", world.name)
    library = world.library.filepath if world.library is not None else ""
    owner = Owner(WORLD, "world", world.name, library, {}, {})
    warnings: list[str] = []
    if _is_empty(world):
        owner.fixed.update({row.name: _NOTHING for row in parameters.of("world")})
        owner.fixed[ENVIRONMENT] = _NOTHING
        return WorldValues(), owner, [], []
    try:
        if evaluated.problem is not None:
            raise Unreadable(*_parts(evaluated.problem))
        values = _read(world, title, evaluated.panoramas, warnings)
    except Unreadable as error:
        reason = Reason(error.problem.cause)
        owner.fixed.update({row.name: reason for row in parameters.of("world")})
        return WorldValues(), owner, [error.problem], warnings
    problems = []
    for parameter in parameters.of("world"):
        value = {
            "strength": (values.strength,),
            "color": values.color,
            ROTATION: (values.rotation,),
        }[parameter.name]
        complaint = parameter.complaint(value)
        if complaint:
            cure = "set a value inside the range"
            problems.append(Problem(title, f"{parameter.name}: {complaint}", cure))
        owner.values[parameter.name] = value
        of_rotation = parameter.name == ROTATION
        reason = find_rotation(world)[1] if of_rotation else find_source(world, parameter)[1]
        if reason:
            owner.fixed[parameter.name] = reason
    if reason := find_inlet(world)[1]:
        owner.fixed[ENVIRONMENT] = reason
    return values, owner, problems, warnings


def find_source(
    world: bpy.types.World, parameter: parameters.Parameter
) -> tuple[Source | None, Reason]:
    """Where strength or colour of the world sits, and why it cannot be written ("" if it can)."""
    background, reason = _found_background(world)
    if background is None:
        return None, reason
    socket = parameter.find(background.node)
    source = nodes.source_of(socket, background.groups)
    return source, nodes.why_not_writable(source, world)


def find_inlet(world: bpy.types.World) -> tuple[bpy.types.NodeSocket | None, Reason]:
    """The Color of the Background, to which an image can be linked, and why none can ("" if one
    can)."""
    background, reason = _found_background(world)
    if background is None:
        return None, reason
    socket = background.node.inputs["Color"]
    return socket, nodes.why_tree_fixed(socket.id_data, background.groups, world)


@dataclass(frozen=True)
class RotationPlace:
    """Where the rotation of the world's image about Z sits. inlet: the Vector of its Environment
    Texture. socket: the Rotation of the Mapping before it; None: that of a new one, which has to
    be put in between."""

    inlet: bpy.types.NodeSocket
    socket: bpy.types.NodeSocket | None

    @property
    def angle(self) -> float:
        """Radians from -pi to pi."""
        if self.socket is None:
            return 0.0
        return math.remainder(float(self.socket.default_value[2]), 2 * math.pi)


def find_rotation(world: bpy.types.World) -> tuple[RotationPlace | None, Reason]:
    """Where the image's rotation can be written, and why it cannot ("" if it can)."""
    socket, reason = find_inlet(world)
    if socket is None or reason:
        return None, reason
    source = nodes.source_of(socket)
    texture = source.node
    if not isinstance(texture, bpy.types.ShaderNodeTexEnvironment):
        return None, Reason(
            "the world has no image", "give it an Environment Texture with a panorama"
        )
    if reason := _why_not_rotated(world):
        return None, reason
    if reason := nodes.why_tree_fixed(texture.id_data, source.groups, world):
        return None, reason
    inlet = texture.inputs["Vector"]
    before = nodes.source_of(inlet, source.groups)
    mapping = before.node
    # The rotation of these types about Z comes last.
    if isinstance(mapping, bpy.types.ShaderNodeMapping) and mapping.vector_type in _FORWARD:
        rotation = nodes.source_of(mapping.inputs["Rotation"], before.groups)
        plain = rotation.node is None and rotation.socket == mapping.inputs["Rotation"]
        if plain and not before.conversion and not nodes.why_not_writable(rotation, world):
            return RotationPlace(inlet, rotation.socket), Reason()
    return RotationPlace(inlet, None), Reason()


def _why_not_rotated(world: bpy.types.World) -> Reason:
    """Why the image of its lone background does not turn by itself; empty if it does."""
    try:
        light, *others = _views(world, thing("World", world.name))
    except Unreadable as error:
        return Reason(error.problem.cause)
    if light.image is None:
        return Reason("its image is evaluated by Cycles together with other nodes", "link it alone")
    if any(view.color is None for view in others):
        return Reason(f"{others[0].rays.name} see another image", "give them a colour")
    return Reason()


def _found_background(world: bpy.types.World) -> tuple[Source | None, Reason]:
    """The shader whose Color and Strength light the scene; None where there is none, and why."""
    if not world.use_nodes or world.node_tree is None:
        return None, Reason("the world does not use nodes", "switch on Use Nodes")
    if _is_empty(world):
        return None, _NOTHING
    try:
        source = panorama.surface_of(_output(world, thing("World", world.name)), LIGHT)
    except Unreadable as error:
        return None, Reason(error.problem.cause)
    if not panorama.is_background(source):
        what = nodes.describe(source.node) if source.node is not None else "empty"
        return None, Reason(f"its surface is {what}", "use one Background node")
    return source, Reason()


def _output(world: bpy.types.World, title: str) -> Output:
    output = nodes.output_of(world.node_tree)
    assert output is not None  # noqa: S101 - the world is not empty
    if output.source("Volume").node is not None:
        raise Unreadable(title, "it is filled with a volume", "unlink the Volume of its output")
    return output


def _is_empty(world: bpy.types.World) -> bool:
    """Whether no shader reaches an output that counts: Cycles shows black."""
    if not world.use_nodes or world.node_tree is None:
        return False
    output = nodes.output_of(world.node_tree)
    return output is None or all(output.source(name).node is None for name in ("Surface", "Volume"))


@dataclass(frozen=True)
class _View:
    """What these rays see. background: the shader whose Strength, a constant, scales it; None: the
    mixture of several. color: of that shader, if it is constant. image: node of the image that it
    is. If neither is there, Cycles evaluates it."""

    rays: Rays
    background: Source | None = None
    strength: float = 1.0
    color: Values | None = None
    image: Source | None = None

    @property
    def is_evaluated(self) -> bool:
        return self.color is None and self.image is None

    def is_same(self, other: _View) -> bool:
        """Whether the other rays see the same."""
        evaluated = self.is_evaluated or other.is_evaluated
        return not evaluated and self.shares_shader(other)

    def shares_shader(self, other: _View) -> bool:
        """Whether Color and Strength of one shader are in both."""
        own, others = self.background, other.background
        return (
            own is not None
            and others is not None
            and (own.node, own.groups) == (others.node, others.groups)
        )


def _views(world: bpy.types.World, title: str) -> list[_View]:
    """What light samples see, and then what rays see to which the background is another one."""
    output = _output(world, title)
    used = panorama.used_outputs(output, title)
    light = _view(output, LIGHT, title)
    views = [_view(output, item, title) for item in panorama.OTHERS if item.outputs & used]
    return [light, *(view for view in views if not view.is_same(light))]


def _view(output: Output, rays: Rays, title: str) -> _View:
    source = panorama.surface_of(output, rays)
    if source.node is None:  # no shader: black
        return _View(rays, color=(0.0, 0.0, 0.0))
    if not panorama.is_background(source):
        _require_evaluable(output, rays, title)
        return _View(rays)
    inputs, groups = source.node.inputs, source.groups
    strength = nodes.constant(nodes.source_of(inputs["Strength"], groups))
    inlet = nodes.source_of(inputs["Color"], groups)
    color = nodes.constant(inlet)
    if strength is not None and color is not None:
        return _View(rays, source, strength[0], nodes.broadcast(color, 3))
    if strength is not None and _is_plain_image(inlet, title):
        return _View(rays, source, strength[0], image=inlet)
    _require_evaluable(output, rays, title)
    return _View(rays, source if strength is not None else None, strength[0] if strength else 1.0)


def _require_evaluable(output: Output, rays: Rays, title: str) -> None:
    missing = images.missing_in(output.tree)
    if missing:
        raise Unreadable(*_parts(missing[0]))
    panorama.require_direction_only(output, rays, title)


def _is_plain_image(source: Source, title: str) -> bool:
    """Whether the image of an Environment Texture can be looked up as it is."""
    node = source.node
    if not isinstance(node, bpy.types.ShaderNodeTexEnvironment):
        return False
    if node.image is None:
        raise Unreadable(title, "its Environment Texture has no image", "choose an image")
    if (
        source.socket.identifier != "Color"
        or source.conversion
        or node.projection != "EQUIRECTANGULAR"
        or node.image.source not in {"FILE", "GENERATED"}
    ):
        return False
    try:
        _to_map(node, source.groups, title)
    except Unreadable:
        return False
    return True


def _read(
    world: bpy.types.World, title: str, found: Mapping[str, Panorama], warnings: list[str]
) -> WorldValues:
    if not world.use_nodes or world.node_tree is None:
        return WorldValues(tuple(world.color), 1.0)
    views = _views(world, title)
    shown = [_shown(view, found, title, warnings) for view in views]
    light, lit = views[0], shown[0]
    color = light.color
    backdrops = []
    for view, seen in zip(views[1:], shown[1:], strict=True):
        scaled = color is None and light.shares_shader(view)
        factor = np.float32(1 if scaled else view.strength)
        backdrops.append(replace(seen, image=seen.image * factor, scaled=scaled))
    if color is not None:
        # Cycles samples what it takes to vary with the direction.
        output = _output(world, title)
        image = np.ones((1, 1, 3), np.float32)
        is_sampled = bool(backdrops) and panorama.is_spatial(output)
        return WorldValues(
            color, light.strength, image if is_sampled else None, backdrops=tuple(backdrops)
        )
    brightest = abs(light.strength) * float(lit.image.max(initial=0))
    if brightest > _BRIGHTEST:
        text = f"its light is {brightest:.0e}, at which Cycles shows all surfaces black; dim it"
        warnings.append(remark(title, text))
    place = find_rotation(world)[0]
    return WorldValues(
        (1.0, 1.0, 1.0),
        light.strength,
        lit.image,
        lit.to_map,
        place.angle if place is not None else 0.0,
        sun=lit.sun,
        backdrops=tuple(backdrops),
    )


def _shown(
    view: _View, found: Mapping[str, Panorama], title: str, warnings: list[str]
) -> BackdropValues:
    """What the rays see at strength 1."""
    kinds = view.rays.kinds
    if view.color is not None:
        return BackdropValues(
            kinds, np.array(view.color, np.float32).reshape(1, 1, 3), np.eye(3), False
        )
    if view.image is not None:
        node = view.image.node
        assert isinstance(node, bpy.types.ShaderNodeTexEnvironment)  # noqa: S101 - a plain image
        image = _environment_image(node, title, warnings)
        to_map = _to_map(node, view.image.groups, title)
        return BackdropValues(kinds, image, to_map, False)
    seen = found.get(view.rays.name)
    if seen is None:
        cause = "Blender is busy and cannot evaluate its nodes"
        raise Unreadable(title, cause, "wait until that has ended, or stop it")
    width, height = seen.size
    size = f"{width} x {height} pixels"
    if view.rays == LIGHT:
        warnings.append(remark(title, f"its nodes are evaluated by Cycles to a panorama of {size}"))
    else:
        rays = view.rays.name
        warnings.append(
            remark(title, f"Cycles evaluates what {rays} see of it to a panorama of {size}")
        )
    return BackdropValues(kinds, seen.pixels, np.eye(3), False, seen.sun)


def _environment_image(
    node: bpy.types.ShaderNodeTexEnvironment, title: str, warnings: list[str]
) -> np.ndarray:
    """(h, w, 3) float32, linear, row 0 at the top; also for packed and generated images."""
    image = node.image
    if image is None:
        raise Unreadable(title, "its Environment Texture has no image", "choose an image")
    title = thing("Image", image.name)
    pixels = images.read_pixels(image)
    if pixels.encoded:
        warnings.append(remark(title, "sRGB environment, decoded before it is interpolated"))
    if node.interpolation != "Linear":
        warnings.append(remark(title, f"interpolated linearly, not by {node.interpolation}"))
    color = np.ascontiguousarray(pixels.decoded(), np.float32)
    if not np.isfinite(color).all():
        raise Unreadable(title, "its pixels are infinite once they are decoded", "repair the image")
    return color


def _to_map(node: bpy.types.ShaderNodeTexEnvironment, groups: Groups, title: str) -> np.ndarray:
    """(3, 3): direction in the image's frame = matrix @ direction in the world."""
    coordinates = read_coordinates(node, groups, title)
    if coordinates.kind != "direction":
        cause = "its image is looked up in one direction only"
        cure = "link the Generated output of Texture Coordinate to the Mapping"
        raise Unreadable(title, cause, cure)
    turn = coordinates.matrix[:, :3]
    scale = np.cbrt(np.linalg.det(turn))  # only the direction counts
    if (
        scale <= 0
        or coordinates.matrix[:, 3].any()
        or not np.allclose(turn @ turn.T, scale**2 * np.eye(3), rtol=0, atol=1e-5 * scale**2)
    ):
        cause = "its Mapping moves, mirrors or stretches the image"
        raise Unreadable(title, cause, "set Location to 0 and Scale to 1")
    return turn / scale


def _parts(problem: Problem) -> tuple[str, str, str]:
    return problem.object, problem.cause, problem.cure
