# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench bird`: the rows of the bird of the 2022 thesis in bench/shape.py, in one table.

A scan with noise: by its colour map; by map and roughness; by vertices and map. A scaled sphere: by
vertices, colour and roughness. Arguments are those of `./dev bench shape`.
"""

import os
import sys

import shape

if __name__ == "__main__":
    rows = tuple(name for name, row in shape.ROWS.items() if row.bird)
    status = shape.main(rows, "./dev bench bird")
    sys.stderr.flush()
    os._exit(status)  # bpy may hang in its own destructors
