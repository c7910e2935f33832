# SPDX-License-Identifier: GPL-3.0-or-later
"""The guide's page of parameters, from the native table; `./dev test` compares the committed page.

Run as a script it rewrites docs/guide/parameters.md.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from selenite._core import ParameterRow

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "guide" / "parameters.md"

OWNERS = {
    "material": "Materials (Principled BSDF)",
    "light": "Lights",
    "world": "World (named `World`)",
}
#: Unknowns with a value at every place, which are in no table of numbers.
FIELDS = (
    "## Values at every place",
    "",
    "A material also has `base_color_texture` and images of other parameters, `albedo_grid` and"
    " `density_grid`, and an object `vertex_colors`: see"
    " [Textures and grids](textures_and_grids.md). The world has `environment`, an image from"
    " 0 up: see [Unknown light](unknown_light.md).",
)
STEPS = {
    "linear": "value",
    "log": "logarithm",
    "log_excess": "log(value - 1)",
    "roughness": "log(value³ + 0.15³) / 3",
    "reflectance": "reflectance of a half-space",
    "angle": "value",
}


def page(table: list[ParameterRow]) -> str:
    """Markdown of the whole table, one section per kind of owner."""
    lines = [
        "# Parameters",
        "",
        "Generated from the table in the native module by `devtools/parameter_page.py`.",
        "*Permitted* is the range of a value, *fit* the default bounds of a fit, and *steps in*"
        " the scale on which Gauss-Newton steps. Colours are three numbers, linear Rec. 709.",
    ]
    for owner, title in OWNERS.items():
        lines += ["", f"## {title}", ""]
        lines += ["| name | socket | unit | permitted | fit | default | steps in | what it is |"]
        lines += ["|---|---|---|---|---|---|---|---|"]
        for row in table:
            if row["owner"] != owner:
                continue
            name = row["name"] + (" (colour)" if row["width"] == 3 else "")
            cells = (
                name,
                " / ".join(row["sockets"]) or "-",
                row["unit"],
                f"{row['lower']:g} to {row['upper']:g}",
                f"{row['fit_lower']:g} to {row['fit_upper']:g}",
                f"{row['initial']:g}",
                STEPS[row["scale"]],
                row["help"],
            )
            lines.append("| " + " | ".join(cells) + " |")
    lines += ["", *FIELDS]
    return "\n".join(lines) + "\n"


def main() -> None:
    sys.path.insert(0, str(ROOT / "addon"))
    from selenite import _core

    PAGE.write_text(page(_core.parameters()), encoding="utf-8")


if __name__ == "__main__":
    main()
