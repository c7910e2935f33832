# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that is known without rendering."""

from __future__ import annotations

import math

import numpy as np

_NODES = 48
_ROUNDS = 400


def fresnel(ior: float, cosine: float) -> float:
    """Share of unpolarised light that a dielectric reflects; `cosine` outside of it."""
    under = ior**2 - 1 + cosine**2
    if under <= 0:
        return 1.0
    g = math.sqrt(under)
    across = ((g - cosine) / (g + cosine)) ** 2
    along = ((cosine * (g + cosine) - 1) / (cosine * (g - cosine) + 1)) ** 2
    return across * (1 + along) / 2


def plate(ior: float, cosine: float = 1.0, depth: float = 0.0) -> float:
    """Share that gets through a plate with all reflections inside it; `depth`: extinction times
    thickness, of a medium that only absorbs, for light at right angles."""
    reflected, kept = fresnel(ior, cosine), math.exp(-depth)
    return (1 - reflected) ** 2 * kept / (1 - (reflected * kept) ** 2)


def veiled_plate(transmission: float) -> float:
    """Through a plate of IOR 1 whose faces let `transmission` pass and scatter the rest as white
    Lambertian surfaces, black sky in front and white behind it: t b with b = t + (1-t)^2 b, which
    is t / (2 - t)."""
    return transmission / (2 - transmission)


def lambert(albedo: float, irradiance: float) -> float:
    """Radiance, W/(m^2 sr)."""
    return albedo * irradiance / math.pi


def cap_irradiance(rows: int, bright: float, dark: float) -> float:
    """On a horizontal plane, of a sky whose topmost of `rows` rows of pixels (from zenith to nadir)
    is `bright` and the rest `dark`, interpolated linearly between the centres of rows."""
    theta = (np.arange(200_000) + 0.5) / 200_000 * math.pi / 2
    row = theta / math.pi * rows - 0.5
    radiance = dark + (bright - dark) * np.clip(1 - row, 0, 1)
    return float((radiance * np.sin(2 * theta)).mean() * math.pi * math.pi / 2)


def half_space(albedo: float) -> float:
    """What a half-space of isotropic scattering returns at right angles of a sky of radiance 1:
    1 - sqrt(1 - albedo) H(1), H being Chandrasekhar's (Radiative Transfer, 1950, eq. V.18)."""
    x, weight = np.polynomial.legendre.leggauss(_NODES)
    x, weight = (x + 1) / 2, weight / 2
    black = math.sqrt(1 - albedo)
    h = np.ones(_NODES)

    def at(mu: np.ndarray) -> np.ndarray:
        return 1 / (black + albedo / 2 * (weight * x * h / (mu[:, None] + x)).sum(axis=1))

    for _ in range(_ROUNDS):
        h = at(x)
    return float(1 - black * at(np.ones(1))[0])
