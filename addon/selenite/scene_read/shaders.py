# SPDX-License-Identifier: GPL-3.0-or-later
"""A surface that is a graph of closures, as a program: nothing of bpy.

Registers are numbered through: constants, literals, then a result for each instruction.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..parameters import Parameter, Values
from ..problems import Reason
from .texture_values import TextureValues

#: What only Blender knows comes as three numbers at each corner, under these names.
GENERATED = ".generated"
ISLAND = ".island"
NORMAL = ".normal"
POINTINESS = ".pointiness"
TANGENT, SIGN = ".tangent ", ".sign "  # and the name of a UV map
SHADED = ".shaded"  # what Cycles calls "N": of vertices, whether faces are flat or not
ALPHA = ".alpha "  # and the name of a colour attribute; 0 where there is none
OPACITY = ".opacity "  # and the name of any; 1 where it has no alpha, or there is none
ATTRIBUTE, FACTOR = ".attribute ", ".factor "  # likewise: its vector or colour, and its number

#: Attributes that Cycles makes of a mesh, by its names; and names of others of its own, under which
#: it finds nothing on a mesh, not even what the user has called so.
MADE = {
    "generated": GENERATED,
    "pointiness": POINTINESS,
    "random_per_island": ISLAND,
    "tangent": TANGENT,
    "N": SHADED,
}
NOT_MADE = frozenset(
    {
        "tangent_sign",
        "undeformed",
        "undisplaced",
        "motion_P",
        "motion_N",
        "particle",
        "shadow_transparency",
        "curve_intercept",
        "curve_length",
        "curve_random",
        "point_random",
        "ptex_face_id",
        "ptex_uv",
        "density",
        "color",
        "flame",
        "heat",
        "temperature",
        "velocity",
        "velocity_x",
        "velocity_y",
        "velocity_z",
    }
)
#: Other names of what renders by default.
USUAL_UV, USUAL_COLOR = "uv", "vertex_color"
#: A matrix, which Cycles ends on.
MATRIX = "generated_transform"
STANDARD = frozenset({*MADE, *NOT_MADE, USUAL_UV, USUAL_COLOR, MATRIX})

#: Rows of a table; Cycles looks ramps and curves up in as many.
TABLE_SIZE = 257
_MOST = 1e6

#: Below this roughness a closure counts as a mirror for the derivatives by its normal.
LEAST_TURNED_ROUGHNESS = 0.05
#: Closures that let light through, whatever their inputs.
_CLEAR = {"glass", "refraction", "translucent", "transparent"}
_OF_MICRONORMALS = {"principled", "glossy", "glass", "refraction", "metallic", "conductor"}
_TURNS_MIRROR = Reason(
    "it turns the normal of a mirror, by which no derivative is computed",
    f"set the roughness to {LEAST_TURNED_ROUGHNESS} or more",
)


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
class ShaderImage:
    """An image of the graph that a fit can change: its name is NODE.image, `texture` its number.
    `uv` (2, 3) is applied to (u, v, 1) of the UV map `attribute`. `channels`: 1 where only a number
    is taken of it."""

    name: str
    texture: int
    attribute: str
    uv: np.ndarray
    channels: int


@dataclass(frozen=True, eq=False)
class Table:
    """`values` (257, 3) from `low` to `high`."""

    values: np.ndarray
    low: float = 0.0
    high: float = 1.0


@dataclass(frozen=True)
class Closure:
    """`inputs`: a register for each parameter of the kind, by name. `shut`: names of the constants
    all of which have to be another number before it has a share of the mixture."""

    kind: str
    inputs: dict[str, Register]
    weight: Register | None = None
    normal: Register | None = None
    tangent: Register | None = None
    distribution: str = "GGX"
    shut: tuple[str, ...] = ()
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
    images: list[ShaderImage] = field(default_factory=list)
    closures: list[Closure] = field(default_factory=list)
    flavour: str = "v2"
    _known: dict[object, Register] = field(default_factory=dict)

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
        return (
            self.constants, self.literals, self.code, self.tables, self.textures, self.names,
            self.images,
        )  # fmt: skip

    def unknown_images(self) -> list[ShaderImage]:
        """Those that can be unknown: looked up at one place, not below a Bump."""
        places = [code.item for code in self.code if code.op == "image"]
        moved = {code.item for code in self.code if code.op == "image" and self._is_moved(code)}
        return [
            item
            for item in self.images
            if places.count(item.texture) == 1 and item.texture not in moved
        ]

    def _is_moved(self, code: Instruction) -> bool:
        """Whether a Bump asks for it beside the point."""
        return any(
            item.kind == "code" and self.code[item.index].shift
            for item in self._behind(code.inputs)
        )

    def known(self) -> dict[object, Register]:
        """A copy of what instructions gave so far."""
        return dict(self._known)

    def forget(self, known: dict[object, Register]) -> None:
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
            if not item.shut
        )

    def is_clear(self) -> bool:
        """Whether light may get through the surface."""
        return any(
            item.kind in _CLEAR
            or (
                item.kind == "principled"
                and (
                    self._number(item.inputs["transmission"]) != 0
                    or self._number(item.inputs["alpha"]) != 1
                )
            )
            for item in self.closures
            if not item.shut
        )

    def fixed_directions(self) -> dict[str, Reason]:
        """Names of the constants by which no derivative is computed, with the reason: what a mirror
        shows moves with its normal."""
        mirrors = [item.normal for item in self.closures if self._mirrors(item)]
        return dict.fromkeys(self.constants_behind(mirrors), _TURNS_MIRROR)

    def _mirrors(self, item: Closure) -> bool:
        """Whether a closure reflects or refracts like a mirror."""
        if item.kind not in _OF_MICRONORMALS:
            return False
        names = ["roughness"]
        if item.kind == "principled" and self._number(item.inputs["coat_weight"]) != 0:
            names.append("coat_roughness")
        found = [self._number(item.inputs[name]) for name in names]
        return any(value is not None and value < LEAST_TURNED_ROUGHNESS for value in found)

    def _number(self, register: Register) -> float | None:
        """The first number of a constant or literal; None if it varies."""
        if register.kind == "code":
            return None
        if register.kind == "literal":
            return self.literals[register.index][0]
        return self.constants[register.index].value[0]

    def constants_behind(self, registers: Iterable[Register | None]) -> set[str]:
        """Names of the constants that these depend on."""
        return {
            self.constants[item.index].parameter.name
            for item in self._behind(registers)
            if item.kind == "constant"
        }

    def _behind(self, registers: Iterable[Register | None]) -> set[Register]:
        """These, and all that they are computed from."""
        left = [item for item in registers if item is not None]
        seen = set(left)
        while left:
            register = left.pop()
            if register.kind == "code":
                inputs = {item for item in self.code[register.index].inputs if item is not None}
                left += inputs - seen
                seen |= inputs
        return seen

    def without_shut(self, fitted: Collection[str]) -> Shader:
        """The same picture for less, while no other constants than `fitted` change: without the
        closures that have no share, and what is computed for them alone."""
        kept = [item for item in self.closures if set(item.shut) <= set(fitted)]
        if len(kept) == len(self.closures):
            return self
        asked = [
            at
            for item in kept
            for at in (*item.inputs.values(), item.weight, item.normal, item.tangent)
        ]
        code = sorted(item.index for item in self._behind(asked) if item.kind == "code")
        new = {at: Register("code", number) for number, at in enumerate(code)}

        def moved(register: Register | None) -> Register | None:
            is_code = register is not None and register.kind == "code"
            return new[register.index] if register is not None and is_code else register

        return replace(
            self,
            code=[
                replace(self.code[at], inputs=tuple(moved(item) for item in self.code[at].inputs))
                for at in code
            ],
            closures=[
                replace(
                    item,
                    inputs={name: moved(at) or at for name, at in item.inputs.items()},
                    weight=moved(item.weight),
                    normal=moved(item.normal),
                    tangent=moved(item.tangent),
                )
                for item in kept
            ],
            _known={},
        )

    @staticmethod
    def _asks(code: Instruction, mode: str) -> bool:
        return code.op == "attribute" and code.mode == mode

    def native(self, textures: list[int], *, physical_refraction: bool) -> dict[str, object]:
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
            "images": [vars(item) for item in self.unknown_images()],
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
                    "tangent": number(item.tangent),
                    "distribution": item.distribution,
                    "subsurface": item.subsurface,
                    "flavour": self.flavour,
                    "physical_refraction": physical_refraction,
                }
                for item in self.closures
            ],
        }


def free_parameter(
    name: str, width: int, value: Values, *, factor: bool, color: bool, text: str
) -> Parameter:
    """The row of a constant that is no parameter of a closure."""
    size = max(1.0, 2 * max(abs(number) for number in value))
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
