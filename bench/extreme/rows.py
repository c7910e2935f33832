# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of extremes: each row is one setting with the light that paper gives for it, its white
furnace, and the place at which its derivative is compared."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from . import paper, scenes
from .ends import FOG, GLASS, LAYERED, METAL, PLASTIC
from .known import CUT
from .measure import Settings, mean_of, render
from .scenes import Values

#: Of a limit, beside four standard errors. The dense media end a free path from rounding.
EXACT, CLOSE, DENSE = 2e-3, 1e-2, 2e-2


@dataclass(frozen=True)
class Limit:
    """A measured number, and what it should be within `tolerance` of itself."""

    measured: float
    error: float
    wanted: float
    tolerance: float

    @property
    def holds(self) -> bool:
        allowed = 4 * self.error + self.tolerance * abs(self.wanted) + 1e-7
        return abs(self.measured - self.wanted) <= allowed


@dataclass(frozen=True)
class Row:
    """One setting. `slope`: parameter, its value and the longest distance; `white`: what to change
    for the furnace, and whether nothing of the light is lost there."""

    group: str
    name: str
    values: Values
    scene: Callable[[Values], Any] = scenes.lit
    slope: tuple[str, float, float] | None = None
    white: Values | None = None
    lossless: bool = False
    limit: Callable[[Settings], Limit] | None = field(default=None, repr=False)
    #: What the white furnace may be above 1.
    gain: float = 1e-3
    #: Beside `Settings.spp`: walks through dense white media are long.
    thrift: int = 1


def seen(scene: Any, wanted: float, tolerance: float) -> Callable[[Settings], Limit]:  # noqa: ANN401
    """The mean of a picture."""

    def measure(settings: Settings) -> Limit:
        mean = mean_of(scene, settings)
        return Limit(mean.value, mean.error, wanted, tolerance)

    return measure


def alike(scene: Any, other: Any, tolerance: float, seeds: tuple = (1, 1)) -> Callable:  # noqa: ANN401
    """The mean of a picture against that of another; with one seed noise is the same in both."""

    def measure(settings: Settings) -> Limit:
        a, b = (mean_of(s, settings, k) for s, k in zip((scene, other), seeds, strict=True))
        error = 0.0 if len(set(seeds)) == 1 else math.hypot(a.error, b.error)
        return Limit(a.value, error, b.value, tolerance)

    return measure


def reflects(values: Values, tolerance: float) -> Callable[[Settings], Limit]:
    """Contrast of the sky in a mirror over that seen without it: 1 if directions are a mirror's."""

    def measure(settings: Settings) -> Limit:
        pair = [render(s, settings, 1) for s in (scenes.mirror(values), scenes.mirrored_view())]
        picture, sky = (np.asarray(film.image, float).mean(axis=2) for film in pair)
        sky = sky[::-1] - sky.mean()
        errors = [np.asarray(film.standard_error, float).mean(axis=2) for film in pair]
        weight = sky / (sky**2).sum()
        noise = math.sqrt(((weight * np.hypot(*errors)) ** 2).sum())
        return Limit(float((picture * weight).sum()), noise, 1.0, tolerance)

    return measure


def _roughness() -> Iterator[Row]:
    smooth, below, above = 0.0, 0.99 * CUT, 1.01 * CUT
    visible = math.sqrt(1e-3)
    places = {
        "alpha 0": (smooth, 0.1 * CUT), "alpha just below the cut": (below, -0.1 * CUT),
        "alpha just above the cut": (above, 0.1 * CUT), "alpha 1e-3": (visible, 0.01),
        "alpha 1": (1.0, -0.16),
    }  # fmt: skip
    for name, (at, step) in places.items():
        mirror = at <= above
        slope = ("roughness", at, step)
        metal = METAL | {"roughness": at}
        limit = reflects(METAL | {"base_color": 1, "roughness": at}, CLOSE) if at < 1 else None
        yield Row(
            "roughness", f"metal, {name}", metal, slope=slope, white={"base_color": 1},
            lossless=True, limit=limit,
        )  # fmt: skip
        glass = {"base_color": 1, "transmission": 1, "ior": 1.5, "roughness": at}
        limit = seen(scenes.plate(glass), paper.plate(1.5), CLOSE) if at < 1 else None
        yield Row(
            "roughness", f"glass, {name}", GLASS | {"roughness": at}, slope=slope,
            white={"base_color": 1}, lossless=mirror, limit=limit,
        )  # fmt: skip


def _ior() -> Iterator[Row]:
    for ior in (0.5, 1 - 1e-4, 1.0, 1 + 1e-4, 1.001, 2.5):
        smooth = {"base_color": 1, "transmission": 1, "ior": ior, "roughness": 0}
        way = 1 if ior >= 1 else -1
        yield Row(
            "IOR", f"smooth glass, {ior:.6g}", GLASS | {"ior": ior},
            slope=("ior", ior, 0.04 * way), white={"base_color": 1, "roughness": 0}, lossless=True,
            limit=seen(scenes.plate(smooth), paper.plate(ior), EXACT),
        )  # fmt: skip
    # Compensation is interpolated in Cycles' tables. They begin at an index of 1, where nothing is
    # lost: in the first cell, up to 1.009, it is too weak, in the next ones a little too strong.
    for ior in (1.0, 1.0002, 1.001, 1.02, 2.5):
        rough = GLASS | {"ior": ior, "roughness": 0.8}
        name = f"glass of roughness 0.8, {ior:g}"
        yield Row("IOR", name, rough, white={"base_color": 1}, gain=5e-3)
    unseen = {"base_color": 1, "transmission": 1, "ior": 1.0, "roughness": 0}
    yield Row(
        "IOR", "1 against an empty place", unseen,
        limit=alike(scenes.lit(unseen), scenes.empty_lit(), EXACT, (1, 2)),
    )  # fmt: skip


def _media() -> Iterator[Row]:
    for depth in (0.0, 1e-4, 1.0, 1e2, 1e4):
        fog = FOG | {"extinction": depth}
        black = scenes.half_space(fog | {"albedo": 0, "anisotropy": 0})
        yield Row(
            "extinction", f"fog, {depth:g}", fog,
            slope=("extinction", depth, 0.2 * depth or 0.16), white={"albedo": 1}, lossless=True,
            limit=seen(black, math.exp(-2 * depth), EXACT), thrift=16 if depth > 10 else 1,
        )  # fmt: skip
        filled = GLASS | {"extinction": depth, "albedo": 1, "base_color": 1, "roughness": 0}
        clear = GLASS | {"base_color": 1, "roughness": 0}
        limit = alike(scenes.lit(filled), scenes.lit(clear), 1e-6) if depth == 0 else None
        yield Row(
            "extinction", f"filled glass, {depth:g}", filled, white={}, lossless=True,
            limit=limit, thrift=32 if depth > 10 else 1,
        )  # fmt: skip
    for albedo in (0.0, 1e-3, 0.999, 1.0):
        dense = {"base_color": 0, "alpha": 0, "albedo": albedo}
        for depth in (1e2, 1e4):
            if albedo > 0.9 and depth < 1e3:
                continue  # light gets through
            body = scenes.half_space(dense | {"extinction": depth})
            slope = ("albedo", albedo, 0.16 if albedo < 0.5 else -0.04)
            yield Row(
                "albedo", f"{albedo:g} at extinction {depth:g}", FOG | {"albedo": albedo},
                slope=slope, limit=seen(body, paper.half_space(albedo), DENSE),
                thrift=64 if albedo == 1 else 1,
            )  # fmt: skip


def _weights() -> Iterator[Row]:
    matte = {"specular_level": 0.0}
    high = math.sin(math.radians(40))
    for base in (0.0, 1.0):
        values = matte | {"base_color": base}
        yield Row(
            "base colour", f"matte, {base:g}", values,
            slope=("base_color", base, 0.16 - 0.32 * base), white={"base_color": 1}, lossless=True,
            limit=seen(scenes.plane(values, elevation=40), paper.lambert(base, high), EXACT),
        )  # fmt: skip
    for share in (0.0, 1e-3, 0.999, 1.0):
        veil = matte | {"base_color": 1, "ior": 1.0, "roughness": 0, "transmission": share}
        yield Row(
            "transmission", f"{share:g}", PLASTIC | {"transmission": share},
            slope=("transmission", share, 0.16 if share < 0.5 else -0.16), white=veil,
            lossless=True, limit=seen(scenes.plate(veil), paper.veiled_plate(share), CLOSE),
        )  # fmt: skip
    for share in (0.0, 1.0):
        body = matte | {"base_color": 0.5, "roughness": 0.3, "metallic": share}
        smooth = body | {"roughness": 0}
        yield Row(
            "metallic", f"{share:g}", PLASTIC | {"metallic": share},
            slope=("metallic", share, 0.16 - 0.32 * share), white=body | {"base_color": 1},
            lossless=True, limit=seen(scenes.half_space(smooth), 0.5, EXACT),
        )  # fmt: skip


def _light() -> Iterator[Row]:
    matte = {"base_color": 0.5, "specular_level": 0.0}
    slope = ("base_color", 0.5, 0.16)

    def lambert(name: str, group: str, wanted: float, **light: Any) -> Row:  # noqa: ANN401
        def scene(values: Values) -> Any:  # noqa: ANN401
            return scenes.plane(values, **light)

        limit = seen(scene(matte), paper.lambert(0.5, wanted), EXACT)
        return Row(group, name, matte, scene, slope, limit=limit)

    low = 0.5
    yield lambert("sun 0.5 degrees high", "grazing", math.sin(math.radians(low)), elevation=low)
    high = math.sin(math.radians(40))
    yield lambert("seen from 0.5 degrees", "grazing", high, elevation=40, view=low)
    for cosine in (0.1, 0.01):
        clear = {"base_color": 1, "transmission": 1, "ior": 1.5, "roughness": 0}
        limit = seen(scenes.plate(clear, cosine), paper.plate(1.5, cosine), CLOSE)
        yield Row("grazing", f"smooth glass at a cosine of {cosine:g}", clear, limit=limit)
    sky = np.full((64, 128, 3), 1e-3)
    sky[0] = 1e6
    wanted = paper.cap_irradiance(64, 1e6, 1e-3)
    yield lambert("cap of 1e6 in a sky of 1e-3", "bright and small", wanted, sky=sky)
    for radius in (0.0, 1e-6, 1e-3):
        name = f"ball lamp of radius {radius:g}"
        yield lambert(name, "bright and small", 1 / (16 * math.pi), lamp=radius, view=80)

    def spotted(values: Values) -> Any:  # noqa: ANN401
        pixel = np.full((64, 128, 3), 1e-3)
        pixel[10, 40] = 1e6
        return scenes.lit(values, sky=pixel)

    body = LAYERED | {"roughness": 0.3}
    yield Row("bright and small", "all lobes under one pixel of 1e6", body, spotted)


def _sizes() -> Iterator[Row]:
    filled = GLASS | {"extinction": 2, "albedo": 0.7}
    one = scenes.lit(filled)
    for size in (1e-4, 1e-2, 1e3, 1e5):
        yield _resized(filled, one, f"{size:g} times as large", size, 0.0)
    for size, shift in ((1.0, 1e4), (1e-2, 1e2), (1.0, -1e5)):
        yield _resized(filled, one, f"{size:g} times as large, {shift:g} away", size, shift)
    yield Row(
        "size", "degenerate triangles added", filled,
        lambda values: scenes.lit(values, mesh=scenes.with_degenerate(scenes.sphere(1))),
        limit=alike(scenes.lit(filled, mesh=scenes.with_degenerate(scenes.sphere(1))), one, EXACT),
    )  # fmt: skip


def _resized(filled: Values, one: Any, name: str, size: float, shift: float) -> Row:  # noqa: ANN401
    values = filled | {"extinction": 2 / size}

    def scene(changed: Values) -> Any:  # noqa: ANN401
        return scenes.lit(changed, size, shift)

    slope = ("extinction", 2 / size, 0.8 / size)
    return Row("size", name, values, scene, slope, limit=alike(scene(values), one, EXACT))


GROUPS = (_roughness, _ior, _media, _weights, _light, _sizes)


def rows(words: list[str]) -> Iterator[Row]:
    """Those whose group or name contains one of the words; all without words. Scenes are built as
    the iteration reaches them."""
    for group in GROUPS:
        for row in group():
            if not words or any(word in f"{row.group} {row.name}" for word in words):
                yield row
