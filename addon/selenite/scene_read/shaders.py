# SPDX-License-Identifier: GPL-3.0-or-later
"""A surface that is a graph of closures, as a program: nothing of bpy.

Registers are numbered through: constants, literals, then a result for each instruction.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..parameters import Parameter, Values
from .texture_values import TextureValues

#: What only Blender knows comes as three numbers at each corner, under these names.
GENERATED = ".generated"
ISLAND = ".island"
NORMAL = ".normal"
TANGENT, SIGN = ".tangent ", ".sign "  # and the name of a UV map

#: Rows of a table; Cycles looks ramps and curves up in as many.
TABLE_SIZE = 257
_MOST = 1e6


@dataclass(frozen=True)
class Register:
    """A place of the program: `kind` is "constant", "literal" or "code"."""

    kind: str
    index: int


@dataclass(frozen=True)
class Instruction:
    """See native/scene/shader/operations.h; `inputs` hold None for a normal that nothing gives."""

    op: str
    inputs: tuple[Register | None, ...]
    mode: str | int | None = None
    flags: tuple[str, ...] = ()
    item: int = -1
    shift: int = 0
    width: float = 0.0


@dataclass(frozen=True)
class Constant:
    """A number or colour of the graph that a fit can change; its name is NODE.socket."""

    parameter: Parameter
    value: Values


@dataclass(frozen=True, eq=False)
class Table:
    """`values` (257, 3) from `low` to `high`."""

    values: np.ndarray
    low: float = 0.0
    high: float = 1.0


@dataclass(frozen=True)
class Closure:
    """`inputs`: a register for each parameter of the kind, by name."""

    kind: str
    inputs: dict[str, Register]
    weight: Register | None = None
    normal: Register | None = None
    multi_ggx: bool = False
    subsurface: str = "RANDOM_WALK"


@dataclass(eq=False)
class Shader:
    """A program under construction, and when it is done what a material holds of it."""

    constants: list[Constant] = field(default_factory=list)
    literals: list[Values] = field(default_factory=list)
    code: list[Instruction] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    textures: list[TextureValues] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    closures: list[Closure] = field(default_factory=list)
    flavour: str = "v2"
    _known: dict[Any, Register] = field(default_factory=dict)

    def literal(self, *numbers: float) -> Register:
        """One number, or three."""
        value = tuple(float(number) for number in numbers)
        if value not in self.literals:
            self.literals.append(value)
        return Register("literal", self.literals.index(value))

    def constant(self, parameter: Parameter, value: Values) -> Register:
        """A new parameter of the material."""
        self.constants.append(Constant(parameter, value))
        return Register("constant", len(self.constants) - 1)

    def emit(
        self,
        op: str,
        *inputs: Register | None,
        mode: str | int | None = None,
        flags: tuple[str, ...] = (),
        item: int = -1,
        shift: tuple[int, float] = (0, 0.0),
    ) -> Register:
        """The result of an instruction; the same one is computed once."""
        code = Instruction(op, inputs, mode, flags, item, *shift)
        if code not in self._known:
            self.code.append(code)
            self._known[code] = Register("code", len(self.code) - 1)
        return self._known[code]

    def name(self, text: str) -> int:
        """The number of an attribute's name."""
        if text not in self.names:
            self.names.append(text)
        return self.names.index(text)

    def texture(self, texture: TextureValues) -> int:
        """The number of a texture."""
        if texture not in self.textures:
            self.textures.append(texture)
        return self.textures.index(texture)

    def table(self, values: np.ndarray, low: float = 0.0, high: float = 1.0) -> int:
        """The number of a new table."""
        self.tables.append(Table(np.asarray(values, np.float32), low, high))
        return len(self.tables) - 1

    def lists(self) -> tuple[list[Any], ...]:
        """What grows while the program is made, but for its closures."""
        return self.constants, self.literals, self.code, self.tables, self.textures, self.names

    def known(self) -> dict[Any, Register]:
        """A copy of what instructions gave so far."""
        return dict(self._known)

    def forget(self, known: dict[Any, Register]) -> None:
        """Goes back to such a copy; whoever calls it cuts the lists."""
        self._known = dict(known)

    def attributes(self, mode: str) -> set[str]:
        """Names that are looked up, mode: "uv", "color" or "vector"."""
        found = {self.names[code.item] for code in self.code if self._asks(code, mode)}
        if mode == "vector":
            for code in self.code:
                if code.op == "normal_map" and code.mode == "TANGENT":
                    found |= set(self.names[code.item : code.item + 3])
        return found

    def emits(self) -> bool:
        """Whether it may give light."""
        zeros = {Register("constant", i) for i, c in enumerate(self.constants) if not any(c.value)}
        return any(
            item.kind == "emission"
            or (item.kind == "principled" and item.inputs["emission_strength"] not in zeros)
            for item in self.closures
        )

    def behind_normals(self) -> set[str]:
        """Names of the constants that a normal of a closure depends on: derivatives by these are
        not computed."""
        found: set[str] = set()
        left = [item.normal for item in self.closures if item.normal is not None]
        seen = set(left)
        while left:
            register = left.pop()
            if register.kind == "constant":
                found.add(self.constants[register.index].parameter.name)
            elif register.kind == "code":
                inputs = {item for item in self.code[register.index].inputs if item is not None}
                left += inputs - seen
                seen |= inputs
        return found

    @staticmethod
    def _asks(code: Instruction, mode: str) -> bool:
        return code.op == "attribute" and code.mode == mode

    def native(self, textures: list[int], *, physical_refraction: bool) -> dict[str, Any]:
        """The form that `SceneBuilder.add_material` takes; `textures`: their numbers there."""
        first = {"constant": 0, "literal": len(self.constants)}
        first["code"] = first["literal"] + len(self.literals)

        def number(register: Register | None) -> int:
            return -1 if register is None else first[register.kind] + register.index

        return {
            "constants": [{**vars(item.parameter), "value": item.value} for item in self.constants],
            "literals": self.literals,
            "names": self.names,
            "textures": textures,
            "tables": [vars(table) for table in self.tables],
            "code": [
                {
                    "op": code.op,
                    "in": [number(item) for item in code.inputs],
                    **({} if code.mode is None else {"mode": code.mode}),
                    "flags": list(code.flags),
                    "item": code.item,
                    "shift": code.shift,
                    "width": code.width,
                }
                for code in self.code
            ],
            "closures": [
                {
                    "kind": item.kind,
                    "inputs": {name: number(at) for name, at in item.inputs.items()},
                    "weight": number(item.weight),
                    "normal": number(item.normal),
                    "multi_ggx": item.multi_ggx,
                    "subsurface": item.subsurface,
                    "flavour": self.flavour,
                    "physical_refraction": physical_refraction,
                }
                for item in self.closures
            ],
        }


def free_parameter(name: str, width: int, value: Values, *, factor: bool, text: str) -> Parameter:
    """The row of a constant that is no parameter of a closure."""
    size = max(1.0, 2 * max(abs(number) for number in value))
    color = width == 3
    low = 0.0 if factor or color or min(value) >= 0 else -size
    return Parameter(
        owner="material",
        name=name,
        sockets=(),
        unit="1",
        width=width,
        lower=-_MOST,
        upper=_MOST,
        fit_lower=low,
        fit_upper=1.0 if factor or (color and size <= 2) else size,
        initial=value[0],
        scale="linear",
        effect="surface",
        versions=("v1", "v2"),
        help=text,
    )
