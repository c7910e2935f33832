# SPDX-License-Identifier: GPL-3.0-or-later
"""A node tree on its way to a program: what arrives at a socket becomes a register."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import bpy

from ....messages import Message, control, joined, phrase
from ....parameters import Parameter, Values
from ....problems import Problem
from ...baking import dependence
from ...baking.wanted import WantedOutput
from ...shaders import GENERATED, Register, Shader, free_parameter
from .. import nodes
from ..nodes import Groups, Source, Unreadable
from ..textures import TextureRoom

#: What a node's output is, given the output socket.
Maker = Callable[["Tree", bpy.types.Node, bpy.types.NodeSocket, Groups], Register]
#: Node type -> its maker; each family of nodes adds its own.
MAKERS: dict[str, Maker] = {}
#: What parts names on the command line.
_PARTED = str.maketrans(":,=", "___")


def parted(name: str) -> str:
    """A name as it stands on the command line."""
    return name.translate(_PARTED)


def maker(*names: str) -> Callable[[Maker], Maker]:
    """Registers a maker for the node types of these names."""

    def add(function: Maker) -> Maker:
        MAKERS.update({f"ShaderNode{name}": function for name in names})
        return function

    return add


#: Cures of what can be baked, and of an image that is missing.
BAKE = phrase("or let Cycles bake it: {bake}", bake=control("bake", "--bake"))
MAGENTA = phrase(
    "or render it magenta as Cycles does: {approximate}",
    approximate=control("approximate", "--approximate"),
)

# Each holds one kind of thing, which who copies it need not know.
_List = list[Any]
_Table = dict[Any, Any]


@dataclass(frozen=True)
class _State:
    """Lengths and contents of what a tree has made so far."""

    lengths: list[int]
    tables: tuple[_Table, ...]
    known: dict[object, Register]
    closures: _List


@dataclass
class Tree:
    """`title`: whose tree, for messages. `sources`: where each constant sits, by its name."""

    title: str
    room: TextureRoom
    shader: Shader = field(default_factory=Shader)
    problems: list[Problem] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    sources: dict[str, Source] = field(default_factory=dict)
    #: What is usually fitted of it, by name; and the constants that are colours.
    usual: list[str] = field(default_factory=list)
    colors: set[str] = field(default_factory=set)
    #: Factors one side of which is left out, as it cannot be rendered.
    one_sided: set[str] = field(default_factory=set)
    #: Below a Bump: 1 or 2, and how many footprints beside the point all is asked for.
    shift: tuple[int, float] = (0, 0.0)
    #: What Displacement makes of the interpolated normal.
    base_normal: Register | None = None
    material_index: int = 0
    #: Outputs that are baked, and the UV map of their images.
    baked: list[WantedOutput] = field(default_factory=list)
    baked_uv: str = ""
    #: Nodes that another shader stands for.
    approximated: list[bpy.types.Node] = field(default_factory=list)
    _results: dict[tuple[object, ...], Register] = field(default_factory=dict)
    _constants: dict[int, Register] = field(default_factory=dict)

    def emit(
        self,
        op: str,
        *inputs: Register | None,
        mode: str | int | None = None,
        flags: tuple[str, ...] = (),
        item: int = -1,
    ) -> Register:
        """An instruction that does not depend on the place beside a Bump's point."""
        return self.shader.emit(op, *inputs, mode=mode, flags=flags, item=item)

    def ask(self, op: str, mode: str, item: int = -1) -> Register:
        """An input of the point, or of the one beside it."""
        return self.shader.emit(op, mode=mode, item=item, shift=self.shift)

    def math(self, mode: str, *inputs: Register, clamp: bool = False) -> Register:
        """Math on numbers; what an operation does not use repeats its last."""
        a, b, c = (*inputs, inputs[-1], inputs[-1])[:3]
        return self.emit("math", a, b, c, mode=mode, flags=("clamp_result",) * clamp)

    def refuse(self, node: bpy.types.Node, cause: str, cure: str) -> Register:
        """Notes a problem, and goes on so that all are known at once. `cause`: {} is the node."""
        problem = Problem(self.title, cause.replace("{}", nodes.describe(node), 1), cure)
        if problem not in self.problems:
            self.problems.append(problem)
        return self.shader.literal(0)

    @contextmanager
    def tried(self) -> Iterator[list[Problem]]:
        """What is added inside stays only where that finds no problem; yields the problems."""
        outer, before = self.problems, self._state()
        found: list[Problem] = []
        self.problems = found
        yield found
        self.problems = outer
        if found:
            self._go_back(before)

    # ---- sockets

    def find(self, node: bpy.types.Node, name: str) -> bpy.types.NodeSocket | None:
        """An input by name or identifier, of several the one in use."""
        found = [item for item in node.inputs if name in {item.name, item.identifier}]
        return next((item for item in found if item.enabled), found[0] if found else None)

    def is_linked(self, node: bpy.types.Node, name: str, groups: Groups) -> bool:
        """Whether a node feeds an input, one that holds a value included."""
        socket = self.find(node, name)
        return socket is not None and nodes.source_of(socket, groups).node is not None

    def get(
        self, node: bpy.types.Node, name: str | int, groups: Groups, otherwise: float = 0.0
    ) -> Register:
        """The register of an input, by name or number; a literal where this Blender has none."""
        socket = node.inputs[name] if isinstance(name, int) else self.find(node, name)
        return self.shader.literal(otherwise) if socket is None else self.value(socket, groups)

    def place(self, node: bpy.types.Node, groups: Groups) -> Register:
        """The Vector of a texture, Generated where nothing is linked to it."""
        if self.is_linked(node, "Vector", groups):
            return self.get(node, "Vector", groups)
        return self.generated()

    def normal(self, node: bpy.types.Node, groups: Groups) -> Register | None:
        """The Normal of a node, None for the interpolated one: nothing is linked to it."""
        if self.is_linked(node, "Normal", groups):
            return self.get(node, "Normal", groups)
        return self.base_normal

    def given(self, normal: Register | None) -> Register:
        """A normal as a register, whatever gives it."""
        return self.ask("geometry", "normal") if normal is None else normal

    def at_offsets(
        self, node: bpy.types.Node, name: str, groups: Groups, width: float
    ) -> tuple[Register, ...]:
        """An input at the point, and so many footprints beside it along x and y."""
        outer = self.shift
        found = []
        for direction in range(3):
            self.shift = (direction, width) if direction else (0, 0.0)
            found.append(self.get(node, name, groups))
        self.shift = outer
        return tuple(found)

    def generated(self) -> Register:
        """Generated texture coordinates."""
        return self.ask("attribute", "vector", self.shader.name(GENERATED))

    def number_of(self, node: bpy.types.Node, name: str, groups: Groups) -> float | None:
        """The number of an input that is constant; None if it varies."""
        socket = self.find(node, name)
        value = (0.0,) if socket is None else nodes.constant(nodes.source_of(socket, groups))
        return None if value is None else value[0]

    def value(self, socket: bpy.types.NodeSocket, groups: Groups) -> Register:
        """What arrives at an input."""
        source = nodes.source_of(socket, groups)
        before, *kinds = source.kinds
        if nodes.constant(source) is not None or source.unset:
            register = self._constant(source)
        elif source.node is None:
            return self.shader.literal(0)
        else:
            register = self._result(source)
        for kind in kinds:
            register = _converted(self, register, before, kind)
            before = kind
        return register

    def _result(self, source: Source) -> Register:
        node, output = source.node, source.socket
        assert node is not None  # noqa: S101 - asked for of nodes only
        within = tuple(group.as_pointer() for group in source.groups)
        key = (node.as_pointer(), within, output.identifier, self.shift)
        if key not in self._results:
            before, known = self._state(), len(self.problems)
            register = self._made(source)
            if len(self.problems) > known:
                register = self._rescued(source, known, before) or register
            self._results[key] = register
        return self._results[key]

    def _made(self, source: Source) -> Register:
        """What the node's own maker gives. Problems are noted."""
        node = source.node
        assert node is not None  # noqa: S101 - see `_result`
        make = MAKERS.get(node.bl_idname)
        if make is None:
            cure = "unlink it, bake it into an image, or give a constant value"
            return self.refuse(node, "{} cannot be evaluated", cure)
        if _is_moved(node):
            cause = "{} has a Texture Mapping in the sidebar, which is not neutral"
            return self.refuse(node, cause, "reset it and use a Mapping node")
        try:
            return make(self, node, source.socket, source.groups)
        except Unreadable as error:
            if error.problem not in self.problems:
                self.problems.append(error.problem)
            return self.shader.literal(0)

    def _rescued(self, source: Source, known: int, before: _State) -> Register | None:
        """The lookup of a baked image in place of what could not be read; None where that cannot be
        or is not wanted: then the cure names it."""
        node, output, groups = source.node, source.socket, source.groups
        assert node is not None  # noqa: S101 - see `_result`
        if self.room.approximations is not None and dependence.is_magenta(node):
            self._go_back(before)
            return _magenta(self, source)
        if self.room.baker is None or not dependence.can_be_baked(node, output, groups):
            self.problems[known:] = [offered(item, source) for item in self.problems[known:]]
            return None
        self._go_back(before)
        wanted = self.room.baker.output(node, output, groups)
        self.baked.append(wanted)
        place = self.ask("attribute", "uv", self.shader.name(self.baked_uv))
        item = self.shader.texture(wanted.texture)
        return self.emit("image", place, mode="FLAT", item=item)

    def _state(self) -> _State:
        """To which `_go_back` returns."""
        kept: tuple[_List, ...] = (self.problems, self.baked, self.usual, *self.shader.lists())
        return _State(
            [len(item) for item in kept],
            (dict(self.sources), dict(self._results), dict(self._constants)),
            self.shader.known(),
            [*self.shader.closures],
        )

    def _go_back(self, before: _State) -> None:
        """Forgets what was made since then."""
        kept: tuple[_List, ...] = (self.problems, self.baked, self.usual, *self.shader.lists())
        for found, length in zip(kept, before.lengths, strict=True):
            del found[length:]
        tables: tuple[_Table, ...] = (self.sources, self._results, self._constants)
        for table, old in zip(tables, before.tables, strict=True):
            table.clear()
            table.update(old)
        self.shader.forget(before.known)
        self.shader.closures[:] = before.closures

    # ---- constants

    def _constant(self, source: Source) -> Register:
        if source.unset:
            return self.shader.literal(0)
        key = source.socket.as_pointer()
        if key not in self._constants:
            value = nodes.constant(Source(source.node, source.socket, source.groups))
            assert value is not None  # noqa: S101 - the caller has asked
            is_factor = getattr(source.socket.bl_rna.properties.get("default_value"), "subtype", "")
            self._constants[key] = self._new_constant(source, value, None, is_factor == "FACTOR")
        return self._constants[key]

    def stops(
        self, node: bpy.types.Node, output: bpy.types.NodeSocket, groups: Groups
    ) -> list[Register]:
        """The colours of a Color Ramp's stops, constants each."""
        found = []
        for number, item in enumerate(node.color_ramp.elements):
            key = item.as_pointer()
            if key not in self._constants:
                source = Source(node, output, groups, stop=number)
                value = tuple(float(channel) for channel in item.color[:3])
                self._constants[key] = self._new_constant(source, value, None, is_factor=False)
            found.append(self._constants[key])
        return found

    def parameter(self, node: bpy.types.Node, row: Parameter, groups: Groups) -> Register:
        """An input of a closure: a constant is described as the closure describes it.

        Raises Unreadable for a constant that lies outside what the closure permits.
        """
        socket = row.find(node)
        if socket is None:
            return self.shader.literal(*(row.initial,) * row.width)
        source = nodes.source_of(socket, groups)
        value = nodes.constant(source)
        if value is None or source.unset or source.conversion:
            return self.value(socket, groups)
        key = source.socket.as_pointer()
        if key not in self._constants:
            value = nodes.broadcast(value, row.width)
            complaint = row.complaint(value)
            if complaint:
                cause = f"input '{socket.name}' of {nodes.describe(node)}: {complaint}"
                self.problems.append(Problem(self.title, cause, "set a value inside the range"))
                return self.shader.literal(0)
            self._constants[key] = self._new_constant(source, value, row, is_factor=False)
        return self._constants[key]

    def _new_constant(
        self, source: Source, value: Values, row: Parameter | None, is_factor: bool
    ) -> Register:
        name = self._name(source)
        is_color = source.socket.type == "RGBA"
        if row is None:
            text = f"Value of {name}"
            row = free_parameter(
                name, len(value), value, factor=is_factor, color=is_color, text=text
            )
        self.sources[name] = source
        if is_color:
            self.colors.add(name)
        return self.shader.constant(replace(row, name=name, owner="material"), value)

    def _name(self, source: Source) -> str:
        """NODE.socket, behind the names of the groups around it; numbered where that is needed."""
        socket = source.socket
        node = socket.node
        within = "".join(f"{group.name}/" for group in source.groups)
        if source.stop >= 0:
            return f"{within}{node.name}.color[{source.stop}]".translate(_PARTED)
        alike = [item for item in node.inputs if item.name == socket.name and item.enabled]
        text = f"{within}{node.name}.{socket.name}".translate(_PARTED)
        if not socket.is_output and len(alike) > 1:
            numbers = [item.identifier for item in alike]
            text += f"[{numbers.index(socket.identifier)}]" if socket.identifier in numbers else ""
        found, number = text, 2
        while found in self.sources:
            found, number = f"{text} {number}", number + 1
        return found


def offered(problem: Problem, source: Source) -> Problem:
    """With the option that helps named in its cure."""
    node = source.node
    assert node is not None  # noqa: S101 - a value needs no cure
    words = ""
    if dependence.is_magenta(node):
        words = MAGENTA
    elif dependence.can_be_baked(node, source.socket, source.groups):
        words = BAKE
    said = problem.cure.arguments.values() if isinstance(problem.cure, Message) else ()
    if not words or BAKE in said or MAGENTA in said:
        return problem
    return replace(problem, cure=joined("; ", (problem.cure, words)))


def _is_moved(node: bpy.types.Node) -> bool:
    """Whether a texture node moves its coordinates by settings of its own."""
    mapping = getattr(node, "texture_mapping", None)
    if mapping is None:
        return False
    neutral = (*mapping.translation, *mapping.rotation) == (0.0,) * 6
    axes = (mapping.mapping_x, mapping.mapping_y, mapping.mapping_z) == ("X", "Y", "Z")
    return not (neutral and axes and tuple(mapping.scale) == (1.0, 1.0, 1.0))


def _converted(tree: Tree, register: Register, before: str, kind: str) -> Register:
    if kind in {"float", "int"} and before in {"color", "vector"}:
        register = tree.emit("luminance" if before == "color" else "mean", register)
    if kind == "int" and before != "int":
        register = tree.emit("truncate", register)
    return register


def _magenta(tree: Tree, source: Source) -> Register:
    """What Cycles shows where an image is missing."""
    node = source.node
    assert node is not None  # noqa: S101 - see `_result`
    assert tree.room.approximations is not None  # noqa: S101 - the caller has asked
    tree.room.approximations.append(
        f"{tree.title}: {nodes.describe(node)} is magenta, as in Cycles: its image is missing"
    )
    if source.socket.identifier == "Alpha":
        return tree.shader.literal(1)
    return tree.shader.literal(1, 0, 1)
