# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether workers compute the same numbers as the fit's own process."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...messages import thing
from ...problems import BadInput, Problem
from . import worker
from .worker import Share

if TYPE_CHECKING:
    from distributed import Client, Future

    from .parcel import Parcel


def compare(
    client: Client, names: list[str], parcel: Parcel, data: Future, share: Share, seconds: float
) -> None:
    """Makes workers know the fit. data: the parcel's, as they have it. Raises BadInput, which names
    every worker that computes other numbers, or does not answer for so many seconds."""
    here = {**worker.facts_here(), "proof": parcel.proof}
    futures = [
        client.submit(worker.about, data, share, workers=[name], pure=False) for name in names
    ]
    problems = []
    for name, future in zip(names, futures, strict=True):
        title = thing("Worker", name)
        try:
            there = future.result(timeout=seconds)
        except Exception as error:
            cause = f"it cannot render this scene ({type(error).__name__}: {error})"
            cure = f"install selenite[cluster] {here['version']} there, for the same Python"
            problems.append(Problem(title, cause, cure))
            continue
        problems += _differences(title, here, there)
    if problems:
        raise BadInput(problems)


def _differences(title: str, here: dict, there: dict) -> list[Problem]:
    if there["version"] != here["version"]:
        cause = f"it has version {there['version']}, the fit is {here['version']}"
        return [Problem(title, cause, "install the same version there")]
    if there["lanes"] != here["lanes"]:
        words = {True: "traces eight paths at a time", False: "traces paths one by one"}
        cause = f"it {words[there['lanes']]}, the fit {words[here['lanes']]}"
        cure = "use processors that all have AVX2, or set SELENITE_AVX2=0 on each machine"
        return [Problem(title, cause, cure)]
    if there["proof"] != here["proof"]:
        cause = "it renders other numbers of the same scene"
        return [Problem(title, cause, "use the same build of Selenite and the same system there")]
    return []
