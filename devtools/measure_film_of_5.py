# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures the colours of thin films in Blender 5.0: native/model/tables/film_table_of_5.cpp.

    PYTHON devtools/measure_film_of_5.py [--check]      # of an environment with bpy 5.0

As measure_thin_film.py does in Blender 4.5. Cycles 5.0 keeps the real and the imaginary part of the
Fourier transform, and lets films lie on metal, whose phase brings in the imaginary one:
reflectances are linear in the nodes. --check compares the table with a render of a third metal.
"""

from __future__ import annotations

import sys
from typing import Any

import bpy
import numpy as np

from measure_thin_film import (
    NODES,
    ORDERS,
    ROOT,
    STEP,
    Floats,
    build,
    command,
    faces,
    render,
)

TABLE = ROOT / "native" / "model" / "tables" / "film_table_of_5.cpp"
FADING = 1.0  # nm
# Index and extinction of the metal, index of the film: no colour of these is cut off at 0 or 1.
MEASURED, CHECKED = ((0.8, 2.5, 2.2), (1.2, 4.0, 1.5)), (0.3, 3.0, 1.8)


def reflectances(thickness: Floats, metal: complex, film: float) -> Floats:
    """(n, 3) of Cycles, for as many thicknesses as there are faces."""
    seen = []
    for thick in (thickness, np.zeros_like(thickness)):
        build(thick, 1.5, film)
        _cover_metal(metal, film)
        seen.append(render())
    return seen[0] / seen[1] * abs((metal - 1) / (metal + 1)) ** 2


def _cover_metal(metal: complex, film: float) -> None:
    material: Any = bpy.data.materials["film"]
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeBsdfMetallic")
    node.fresnel_type, node.distribution = "PHYSICAL_CONDUCTOR", "GGX"
    given = {"IOR": (metal.real,) * 3, "Extinction": (metal.imag,) * 3, "Thin Film IOR": film}
    for name, value in given.items():
        node.inputs[name].default_value = value
    thickness = node.inputs["Thin Film Thickness"]
    tree.links.new(tree.nodes["Attribute"].outputs["Fac"], thickness)
    tree.links.new(node.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])


def equations(thickness: Floats, metal: complex, film: float) -> tuple[Floats, Floats]:
    """What the nodes (real ones first) add to the reflectance without interference; that."""
    t = np.clip(thickness / FADING, 0, 1)
    index = 1.0 + (film - 1) * t * t * (3 - 2 * t)
    top, below = (1 - index) / (1 + index), (index - metal) / (index + metal)
    through, bottom2 = 1 - top**2, np.abs(below) ** 2
    rest = through**2 * bottom2 / (1 - top**2 * bottom2)
    system, rows = np.zeros((len(thickness), 2 * NODES)), np.arange(len(thickness))
    for m in ORDERS:
        factor = 2 * (rest - through) * (-top * below) ** m
        x = np.clip(m * 2 * index * thickness / STEP, 0, NODES - 1)
        low = np.minimum(x.astype(int), NODES - 2)
        for at, share in ((low, 1 - (x - low)), (low + 1, x - low)):
            system[rows, at] += factor.real * share
            system[rows, NODES + at] += factor.imag * share
    return system, top**2 + rest


def measure() -> tuple[Floats, float]:
    """The tables (channel, 2, NODES); the largest residual."""
    systems, wanted = [], []
    for n, k, film in MEASURED:
        system, plain = equations(faces(film), complex(n, k), film)
        systems.append(system)
        wanted.append(reflectances(faces(film), complex(n, k), film) - plain[:, None])
    pinned = np.zeros((2, 2 * NODES))
    pinned[0, 0] = pinned[1, NODES] = 1e4  # the transform of no path is 1
    system = np.vstack([*systems, pinned])
    values = np.vstack([*wanted, np.full((1, 3), 1e4), np.zeros((1, 3))])
    nodes, *_ = np.linalg.lstsq(system, values, rcond=None)
    return nodes.T.reshape(3, 2, NODES), float(np.abs(system @ nodes - values).max())


def check(tables: Floats) -> None:
    """Differences between the table and renders of another metal."""
    n, k, film = CHECKED
    system, plain = equations(faces(film), complex(n, k), film)
    seen = reflectances(faces(film), complex(n, k), film)
    ours = np.clip(plain[:, None] + system @ tables.reshape(3, 2 * NODES).T, 0, 1)
    spread = np.percentile(np.abs(ours - seen) / seen.max(axis=1, keepdims=True), (50, 99, 100))
    sys.stderr.write(f"relative differences, median, 99 %, largest: {spread}\n")


if __name__ == "__main__":
    command(measure, check, TABLE, ("kFilmReal", "kFilmImaginary"))
