# SPDX-License-Identifier: GPL-3.0-or-later
"""What a revision may call otherwise without being different: extend these tables with a renaming.

Names of both sides are brought to the new ones before they are compared.
"""

from __future__ import annotations

#: Keys of JSON objects and headers of tables, old -> new.
KEYS = {
    "rivals": "alternative_minima",
    "contested": "ambiguous",
    "secants": "finite_differences",
    "verification": "refinement",
    "verification_spp": "refinement_spp",
    "coordinate": "scale",
}

#: Parts of sentences and words in results, old -> new, replaced one after another.
TEXTS: tuple[tuple[str, str], ...] = (
    ("searching", "multi-start"),
    ("verifying", "refinement"),
)

#: Files of a result folder, old -> new.
FILES: dict[str, str] = {}

#: Phases of a running fit, as `Progress.phase` says them.
PHASES = {
    "searching": "multi-start",
    "fitting": "descent",
    "verifying": "refinement",
    "multi-start": "multi-start",
    "descent": "descent",
    "refinement": "refinement",
    "comparison": "comparison",
}

#: Native settings that the command line does not know: names, newest first.
SETTINGS = {
    "finite_differences": ("finite_differences", "secants"),
    "refinement": ("refinement", "verification"),
}

#: Keys whose values are times, places, or facts about the machine and the versions.
LEFT_OUT = frozenset({
    "seconds", "cpu_seconds", "expected_seconds", "iteration_cpu_seconds", "versions", "selenite",
    "folder", "saved", "out", "sem", "scene",
})  # fmt: skip
