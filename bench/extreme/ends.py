# SPDX-License-Identifier: GPL-3.0-or-later
"""Every scalar parameter of the material table at both ends of its range and where its model
changes: the carried derivative against one-sided differences of pictures.

A parameter that is added to the native table is in here the same day: its ends come from there.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from selenite import parameters

from .known import CUT
from .measure import Settings, Slope, slope_of
from .scenes import Values, lit

#: Some of every lobe.
LAYERED: Values = {
    "base_color": [0.6, 0.4, 0.3], "roughness": 0.45, "metallic": 0.3, "ior": 1.45, "alpha": 0.8,
    "transmission": 0.5, "specular_level": 0.6, "specular_tint": [0.8, 0.65, 0.5],
    "diffuse_roughness": 0.4, "emission_color": 0.3, "emission_strength": 0.5,
}  # fmt: skip
PLASTIC: Values = {"base_color": 0.2, "roughness": 0.45}
METAL: Values = {"base_color": 0.6, "roughness": 0.45, "metallic": 1}
GLASS: Values = {"base_color": 0.8, "roughness": 0.45, "transmission": 1, "ior": 1.45}
COATED = PLASTIC | {"coat_weight": 0.7, "coat_roughness": 0.35, "coat_ior": 1.6, "coat_tint": 0.7}
VELVET: Values = {
    "base_color": 0, "specular_level": 0, "sheen_weight": 1, "sheen_roughness": 0.45,
    "sheen_tint": 0.7,
}  # fmt: skip
WAX: Values = {
    "base_color": 0.7, "specular_level": 0.2, "subsurface_weight": 1, "subsurface_scale": 0.3,
    "subsurface_anisotropy": 0.3,
}  # fmt: skip
SKIN = WAX | {"subsurface": "RANDOM_WALK_SKIN"}
OLD_GLASS = GLASS | {"transmission_roughness": 0.3}
FOG: Values = {
    "base_color": 0, "alpha": 0, "extinction": 2, "albedo": 0.7, "anisotropy": 0.3
}  # fmt: skip
FILLED = GLASS | {"extinction": 2, "albedo": 0.7, "anisotropy": 0.3}
#: The base of a parameter's rows, where `LAYERED` would show too little of it.
BASES = {
    "roughness": ("plastic", PLASTIC),
    "ior": ("plastic", PLASTIC),
    "coat": ("coated", COATED),
    "sheen": ("velvet", VELVET),
    "specular": ("plastic", PLASTIC),
    "diffuse_roughness": ("plastic", PLASTIC | {"specular_level": 0, "base_color": 0.7}),
    "transmission_roughness": ("glass of Blender 3", OLD_GLASS),
    "subsurface_ior": ("skin", SKIN),
    "subsurface": ("wax", WAX),
    "extinction": ("fog", FOG),
    "albedo": ("fog", FOG),
    "anisotropy": ("fog", FOG),
}
#: Where ranges end further out, steps are a share of the value.
_WIDE = 100.0
_SHARE = 0.2
_STEP = 0.16
_CLOSE = 0.1 * CUT
#: Shorter steps where the model bends on a shorter scale: cuts of Cycles (sheen from 0.001 on,
#: anisotropy under the surface up to 0.9, index of skin from 1.01 to 3.8), tables over the root of
#: the index's excess and over the fibres' roughness, a polynomial of degree 7 in the anisotropy.
_STEPS = {
    ("roughness", 0): _CLOSE,
    ("coat_roughness", 0): _CLOSE,
    ("sheen_roughness", 0): 4e-4,
    ("sheen_roughness", 1): 0.01,
    ("sheen_roughness", 0.999): 0.01,
    ("sheen_roughness", 0.1): 0.01,
    ("coat_ior", 1): 4e-3,
    ("ior", 1e-5): 4e-4,
    ("subsurface_ior", 1): 4e-3,
    ("subsurface_anisotropy", 0): 0.01,
    ("subsurface_anisotropy", 0.9): 0.004,
    ("subsurface_anisotropy", 1): 0.04,
    ("anisotropy", 0.999): 0.01,
    ("anisotropy", -0.999): 0.01,
    ("specular_level", 0.001): 0.002,
    ("coat_tint", 0.001): 0.002,
    ("base_color", 0.001): 0.004,
    ("subsurface_scale", 1e-4): 4e-5,
    ("extinction", 1e-3): 0.16,
}


@dataclass(frozen=True)
class End:
    """`at`: the value of all components; `step`: the longest distance, negative for downwards."""

    parameter: str
    at: float
    step: float
    base: str
    values: Values
    #: The end of the range of a fit, where nothing may be dead.
    of_fit: bool = False


def _base(name: str) -> tuple[str, Values]:
    for start, found in BASES.items():
        if name.startswith(start):
            return found
    return "all lobes", LAYERED


def _step(name: str, at: float, room: float) -> float:
    """`room`: to the other end of the range."""
    usual = _STEP if room < _WIDE else _SHARE * at or _SHARE
    return _STEPS.get((name, at), min(usual, room / 4))


def _of_ranges() -> Iterator[End]:
    for p in parameters.of("material"):
        base, values = _base(p.name)
        places = [(p.lower, 1, False), (p.upper, -1, False)]
        places += [(at, way, True) for at, way in ((p.fit_lower, 1), (p.fit_upper, -1))]
        for at, way, of_fit in places:
            step = way * _step(p.name, at, p.upper - p.lower)
            yield End(p.name, at, step, base, values, of_fit)


def _special() -> Iterator[End]:
    bodies = (("plastic", PLASTIC), ("metal", METAL), ("glass", GLASS))
    for base, values in bodies:
        yield End("roughness", 0, _CLOSE, base, values)
        yield End("roughness", 1.01 * CUT, _CLOSE, base, values)
        yield End("roughness", 0.02, 0.02, base, values, True)
        yield End("roughness", 1, -_STEP, base, values)
        # Towards the slope of glass differences come as the root of the distance.
        yield End("base_color", 0, 0.01 if base == "glass" else _STEP, base, values)
        yield End("base_color", 1, -_STEP, base, values)
        yield End("specular_tint", 0, _STEP, base, values)
        yield End("specular_tint", 1, -_STEP, base, values)
    for base, values in (("plastic", PLASTIC), ("glass", GLASS)):
        for way in (1, -1):
            yield End("ior", 1, 0.04 * way, base, values)
            yield End("ior", 1 + 2e-4 * way, 0.04 * way, base, values)
        yield End("ior", 2.5, -_STEP, base, values, True)
        yield End("transmission", 0, _STEP, base, values)
        yield End("transmission", 1, -_STEP, base, values)
        yield End("metallic", 0, _STEP, base, values)
        yield End("metallic", 1, -_STEP, base, values)
    yield End("coat_roughness", 1.01 * CUT, _CLOSE, "coated", COATED)
    yield End("ior", 1.5, _STEP, "smooth glass", GLASS | {"roughness": 0})
    yield End("ior", 1.5, _STEP, "smooth plastic", PLASTIC | {"roughness": 0})
    yield End("subsurface_ior", 3.8, -_STEP, "skin", SKIN)
    yield End("subsurface_anisotropy", 0.9, -0.004, "wax", WAX)
    for base, values in (("filled glass", FILLED), ("dense fog", FOG | {"extinction": 20})):
        yield End("albedo", 0, _STEP, base, values)
        yield End("albedo", 1, -0.008, base, values)
        yield End("anisotropy", 0, _STEP, base, values)
    yield End("extinction", 0, _STEP, "filled glass", FILLED)


def ends(words: list[str]) -> list[End]:
    """Rows whose parameter or base contains one of the words; all without words."""
    found = [*_of_ranges(), *_special()]
    chosen = [e for e in found if not words or any(w in f"{e.parameter} {e.base}" for w in words)]
    unique: dict[tuple, End] = {}
    for end in chosen:
        unique.setdefault((end.parameter, end.at, end.step > 0, end.base), end)
    return list(unique.values())


def measure_end(end: End, settings: Settings) -> Slope:
    return slope_of(lit(end.values), end.parameter, end.at, end.step, settings)
