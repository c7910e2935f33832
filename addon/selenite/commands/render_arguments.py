# SPDX-License-Identifier: GPL-3.0-or-later
"""Options that several commands have, and words of their help."""

from __future__ import annotations

import argparse
from collections.abc import Callable

#: Of `--save OUT.blend`.
KEPT = "; a file that is there is kept as OUT.blend1"
PHYSICAL = "no refraction towards lights that no micronormal gives; Cycles has it"


def add_of_fits(add: Callable[..., object], *, depth: bool = True) -> None:
    """Of a command that fits, or predicts a fit: None where the fit's own setting counts. depth:
    False for a command that chooses it."""
    if depth:
        add("--depth", type=int, help="bounces; 0: unlimited")
    add("--seed", type=int, help="of the random numbers; default: 0")
    add("--threads", type=int, help="0: all")
    add("--physical-refraction", action="store_true", default=None, help=PHYSICAL)


def add_reading(parser: argparse.ArgumentParser) -> None:
    """Of a command that reads a scene: what becomes of materials that cannot be read."""
    add = parser.add_argument_group("materials that cannot be read").add_argument
    bake = "Cycles bakes outputs of nodes that are not evaluated into images, kept beside the scene"
    add("--bake", action="store_true", help=f"{bake} in selenite-fits/baked")
    nearest = "what still cannot be read is rendered as the nearest shader, and named in a warning"
    add("--approximate", action="store_true", help=nearest)
