# SPDX-License-Identifier: GPL-3.0-or-later
"""The demo and cases as plans of the product, which have stages and Fisher information."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from selenite import native, parameters
from selenite.advice.trade import choices
from selenite.capture.prepared import Capture
from selenite.fit.job import FitJob, fitted_values
from selenite.fit.plan import FitPlan, build_scene
from selenite.fit.request import RunRequest
from selenite.fit.settings import FitSettings
from selenite.fit.unknowns import Unknown

from . import cases, fits

DEMO = "demo"
_PHOTO_SEED = 987654321


@dataclass(frozen=True)
class Subject:
    """A native scene, one material in it with its true values and those of the start, and the
    aspect of the photos (width / height)."""

    scene: Any
    owner: str
    true: dict[str, Any]
    start: dict[str, Any]
    aspect: float

    def plan(
        self, values: dict[str, Any], captures: Sequence[Capture], settings: FitSettings
    ) -> FitPlan:
        """A fit of this material that starts at some values."""
        table = parameters.table()
        unknowns = []
        for name, value in values.items():
            row = table["material", name]
            start = tuple(float(x) for x in np.ravel(value))
            unknowns.append(Unknown(self.owner, row, start, row.fit_lower, row.fit_upper, 0.03))
        at = self.scene.with_values({(self.owner, u.parameter.name): u.start for u in unknowns})
        request = RunRequest("", settings=settings)
        return FitPlan(request, at, list(captures), unknowns, [], [], "", None)

    def photos(self, height: int, spp: int) -> list[Capture]:
        """Photos of our own at the true values, one by each camera."""
        scene, width = self.plan(self.true, [], FitSettings()).scene, round(height * self.aspect)
        found = []
        for index, camera in enumerate(scene.cameras):
            film = native.core().render(scene, camera, width, height, spp, seed=_PHOTO_SEED + index)
            weight = np.ones((height, width), np.float32)
            picture = np.ascontiguousarray(film.image, np.float32)
            size = (width, height)
            aspect = width / height
            found.append(Capture(camera, camera, "own", size, picture, weight, aspect))
        return found


def subject(name: str) -> Subject:
    """DEMO, or KIND-SEED of a case."""
    if name != DEMO:
        kind, _, seed = name.partition("-")
        case = cases.make(kind, int(seed))
        return Subject(fits.scene_of(case), fits.scenes.OWNER, case.target, case.start, 1.0)
    import jade_pendant

    from selenite.scene_read.scene import read_scene

    demo = jade_pendant
    scene = build_scene(read_scene(demo.build(demo.TRUTH)))
    width, height = demo.RESOLUTION
    return Subject(scene, demo.MATERIAL, demo.TRUTH, demo.START, width / height)


def fit(plan: FitPlan, truth: FitPlan) -> tuple[dict[str, Any], dict[str, float]]:
    """(result of the whole fit, error of each unknown); truth: a plan at the true values."""
    job = FitJob(plan)
    job.start()
    job.join()
    result = job.result()
    values = fitted_values(plan, result)
    return result, {
        item.name: choices.error_of(item, values[item.owner, item.parameter.name])
        for item in truth.unknowns
    }


def parser(bench: str, about: str, usual: Sequence[str], seeds: int) -> argparse.ArgumentParser:
    """What such a bench is asked: subjects, their number of fits, and see `settings_of`."""
    made = argparse.ArgumentParser(prog=f"./dev bench {bench}", description=about)
    add = made.add_argument
    add("cases", nargs="*", default=usual, help=f"demo, or KIND-SEED ({' '.join(usual)})")
    add("--height", type=int, default=64, help="pixels of the photos (%(default)s)")
    add("--iterations", type=int, default=40, help="(%(default)s)")
    add("--spp", type=int, default=4, help="samples of an iteration (%(default)s)")
    add("--seeds", type=int, default=seeds, help="fits of each (%(default)s)")
    return made


def settings_of(options: argparse.Namespace) -> FitSettings:
    """Of the fits, on one thread."""
    return FitSettings(
        iterations=options.iterations, spp=options.spp, height=options.height, threads=1
    )
