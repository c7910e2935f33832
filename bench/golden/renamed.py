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
    "cameras": "photos",
}

#: Keys that an older revision may lack.
ADDED = frozenset({"ambiguous", "id", "pictures"})

#: Parts of sentences and words in results, old -> new, replaced one after another.
TEXTS: tuple[tuple[str, str], ...] = (
    ("searching", "multi-start"),
    ("verifying", "refinement"),
    ("the values have settled", "converged"),
    ("at the values that the search found", "at the values that multi-start found"),
    (
        "do not tell all parameters apart, and this suffers most by it",
        "do not separate all parameters, and this one suffers most from it",
    ),
    ("No errors are told: ", "Errors are not estimated: "),
    ("look again after the fit", "estimate again after the fit"),
    ("look whether light", "check whether light"),
    ("The photo of '", "Photo '"),
    ("; of '", "; '"),
    ("of the difference of '", "of the difference of photo '"),
    ("No place tells much more than the photos do:", "No place adds much to the photos:"),
    ("a parameter that others make up for", "a parameter that others compensate for"),
    ("for what makes up for it", "for what compensates for it"),
    (" make up for each other", " compensate for each other"),
    ("itself would tell as much", "itself would add as much"),
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

#: The method that brings the record of a run up to date: names, newest first.
UPDATE_RECORD = ("update", "look")

#: Keys whose values are times, places, or facts about the machine and the versions.
LEFT_OUT = frozenset({
    "seconds", "cpu_seconds", "expected_seconds", "iteration_cpu_seconds", "versions", "selenite",
    "folder", "saved", "out", "sem", "scene",
})  # fmt: skip


def first_of(owner: object, names: tuple[str, ...]) -> str:
    """The newest of these names that `owner` has. Raises AttributeError."""
    for name in names:
        if hasattr(owner, name):
            return name
    raise AttributeError(f"{owner} has none of {', '.join(names)}")
