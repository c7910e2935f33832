# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading a table of BSDF values (CSV) part by part; what is wrong is a Problem."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import numpy as np
from numpy.typing import NDArray

from .. import native
from ..problems import Problem, listed

if TYPE_CHECKING:
    from .._core import ProbeColumn

# Results of an earlier evaluation, in Cycles or here: they make room for ours.
RESULTS = ("f_cos_r", "f_cos_g", "f_cos_b", "rel_float_noise")
SLOPE = "d_f_cos_"
REMARKS = ("family", "side")
DISTRIBUTIONS = ("GGX", "MULTI_GGX")
LONGEST_REPORT = 20  # problems
UNIT_TOLERANCE = 1e-4  # directions may be rounded to four digits


@dataclass
class Layout:
    """What the columns of a table are."""

    version: str  # of the Principled BSDF: "v1" or "v2"
    header: list[str]
    numbers: list[int]  # places of the numbers in a row
    columns: list[ProbeColumn]
    distribution: int
    kept: list[int]  # places of what the output repeats

    @property
    def names(self) -> list[str]:
        """Names of the columns of numbers."""
        return [column["name"] for column in self.columns]

    @property
    def parameters(self) -> list[str]:
        """Names of the columns that can be differentiated by."""
        return [column["name"] for column in self.columns if column["parameter"]]


@dataclass
class Part:
    """Some rows of a table."""

    cells: list[list[str]]
    lines: list[int]  # where they stand in the file
    numbers: NDArray[np.float64]  # (rows, Layout.numbers)
    multi_ggx: NDArray[np.bool_]


@dataclass
class TableReader:
    """Reads `file`; after a problem the parts that follow are checked but not handed out."""

    path: Path
    file: TextIO
    rows_per_part: int = 1 << 14
    problems: list[Problem] = field(default_factory=list)
    _line: int = 0

    def complain(self, cause: str, cure: str, line: int = 0) -> None:
        """Notes a problem, of one line or of the file as a whole."""
        place = f", line {line}" if line else ""
        self.problems.append(Problem(f"File '{self.path.name}'{place}", cause, cure))

    def _lines(self) -> Iterator[str]:
        for number, text in enumerate(self.file, 1):
            self._line = number
            if text.strip() and not text.startswith("#"):
                yield text

    def parts(self) -> Iterator[tuple[Layout, Part]]:
        """The table in parts. Look at `problems` when it has ended."""
        try:
            rows = csv.reader(self._lines(), strict=True)
            header = next(rows, None)
            layout = self._layout([name.strip() for name in header] if header else [])
            if layout is None:
                return
            seen = 0
            while len(self.problems) < LONGEST_REPORT:
                cells, lines = [], []
                for row in rows:
                    if len(row) != len(layout.header):
                        self.complain(
                            f"has {len(row)} cells under {len(layout.header)} columns",
                            "write one cell for each column",
                            self._line,
                        )
                    else:
                        cells.append(row)
                        lines.append(self._line)
                    if len(cells) == self.rows_per_part or len(self.problems) >= LONGEST_REPORT:
                        break
                if not cells:
                    break
                seen += len(cells)
                part = self._part(layout, cells, lines)
                if part is not None and not self.problems:
                    yield layout, part
            if not seen and not self.problems:
                self.complain("has no rows", "write rows below the header")
        except UnicodeDecodeError as error:
            self.complain(f"is not text in UTF-8 ({error.reason})", "save it as UTF-8")
        except csv.Error as error:
            self.complain(f"is not a table ({error})", "separate cells by commas", self._line)
        if len(self.problems) > LONGEST_REPORT:
            del self.problems[LONGEST_REPORT:]
            self.complain("there are more problems", "mend those above first")

    def _layout(self, header: list[str]) -> Layout | None:
        if not header:
            self.complain("is empty", "write a header row with the names of the columns")
            return None
        versions = {"specular": "v1", "specular_level": "v2"}
        found = [name for name in versions if name in header]
        if len(found) != 1:
            self.complain(
                "has both columns 'specular' and 'specular_level'"
                if found
                else "has neither a column 'specular_level' nor 'specular'",
                "give specular_level for the Principled BSDF of Blender 4, specular for Blender 3",
            )
            return None
        version = versions[found[0]]
        known = {column["name"]: column for column in native.core().probe_columns(version)}
        required = [name for name, column in known.items() if column["required"]]
        missing = [name for name in ("distribution", *required) if name not in header]
        others = ("distribution", *REMARKS, *RESULTS)
        unknown = [
            name
            for name in dict.fromkeys(header)
            if name not in known and name not in others and not name.startswith(SLOPE)
        ]
        for name in dict.fromkeys(header):
            if header.count(name) > 1:
                self.complain(f"has the column '{name}' twice", "keep one of them")
        for color in sorted({name[:-2] for name in header if name in known and name[-2:-1] == "_"}):
            channels = [name for name in known if name[:-1] == color + "_"]
            if not set(channels) <= {*header, *missing}:
                missing += [name for name in channels if name not in header]
        if missing:
            self.complain(f"lacks the columns {listed(missing)}", "add them")
        if unknown:
            self.complain(
                f"has columns that mean nothing here: {listed(unknown)}",
                f"the columns of {version} are {', '.join(('distribution', *known))}",
            )
        if self.problems:
            return None
        places = [place for place, name in enumerate(header) if name in known]
        return Layout(
            version,
            header,
            places,
            [known[header[place]] for place in places],
            header.index("distribution"),
            [
                place
                for place, name in enumerate(header)
                if name not in RESULTS and not name.startswith(SLOPE)
            ],
        )

    def _part(self, layout: Layout, cells: list[list[str]], lines: list[int]) -> Part | None:
        before = len(self.problems)
        numbers = np.empty((len(cells), len(layout.numbers)))
        for k, (place, column) in enumerate(zip(layout.numbers, layout.columns, strict=True)):
            numbers[:, k] = self._numbers([row[place] for row in cells], lines, column)
        if len(self.problems) == before:
            self._check_directions(layout, numbers, lines)
        distributions = [row[layout.distribution].strip() for row in cells]
        permitted = DISTRIBUTIONS[: 1 if layout.version == "v1" else 2]
        if not set(distributions) <= set(permitted):
            for text, line in zip(distributions, lines, strict=True):
                if text not in permitted:
                    cure = f"permitted in {layout.version}: {listed(permitted)}"
                    self.complain(f"distribution is '{text}'", cure, line)
        if len(self.problems) > before:
            return None
        multi_ggx = np.array([text == "MULTI_GGX" for text in distributions])
        return Part(cells, lines, numbers, multi_ggx)

    def _numbers(
        self, texts: list[str], lines: list[int], column: ProbeColumn
    ) -> NDArray[np.float64]:
        """One column; every cell that is no permitted number is a problem."""
        name, lower, upper = column["name"], column["lower"], column["upper"]
        cure = f"write a number in [{lower:g}, {upper:g}]" if column["parameter"] else ""
        cure = cure or "write a component of a vector of length 1"
        values = np.empty(len(texts))
        try:
            values[:] = [float(text) for text in texts]
        except ValueError:
            for i, text in enumerate(texts):
                try:
                    values[i] = float(text)
                except ValueError:
                    values[i] = lower  # reported here and not again below
                    self.complain(f"{name} = '{text.strip()}' is not a number", cure, lines[i])
        for i in np.flatnonzero(~((values >= lower) & (values <= upper))):  # NaN as well
            value = float(values[i])
            cause = "lies outside the range" if math.isfinite(value) else "is not finite"
            self.complain(f"{name} = {value:.9g} {cause}", cure, lines[i])
        return values

    def _check_directions(
        self, layout: Layout, numbers: NDArray[np.float64], lines: list[int]
    ) -> None:
        names = layout.names
        for direction in ("wi", "wo"):
            components = numbers[:, [names.index(f"{direction}_{axis}") for axis in "xyz"]]
            lengths = np.linalg.norm(components, axis=1)
            for i in np.flatnonzero(np.abs(lengths - 1) > UNIT_TOLERANCE):
                cause = f"{direction} has the length {lengths[i]:.6g}"
                self.complain(cause, "give a vector of length 1", lines[i])
            if direction == "wi":
                for i in np.flatnonzero(components[:, 2] == 0):
                    cure = "give a direction off the surface"
                    self.complain("wi_z is 0: nothing is seen from there", cure, lines[i])
