# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench expected`: errors that a look expects, against those of fits and what fits tell.

For each case photos of our own at the true values, one look there, and fits with several seeds.
Prints a row for each parameter, colours as the root mean square of their channels:
expected and told standard error (median over the fits), error of the fits (root mean square).
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "bench"), str(ROOT / "scenes")]

import numpy as np  # noqa: E402
from synthetic import cases, fits  # noqa: E402

from selenite import native, parameters  # noqa: E402
from selenite.fit_run.captures import Capture  # noqa: E402
from selenite.fit_run.job import FitJob, fitted_values  # noqa: E402
from selenite.fit_run.plan import FitPlan  # noqa: E402
from selenite.fit_run.request import RunRequest  # noqa: E402
from selenite.fit_run.settings import FitSettings  # noqa: E402
from selenite.fit_run.unknowns import Unknown  # noqa: E402
from selenite.looks.photos import Looks  # noqa: E402
from selenite.trade import choices  # noqa: E402
from selenite.trade.expected import errors_of  # noqa: E402

_PHOTO_SEED = 987654321


def demo() -> tuple[Any, str, dict[str, Any], dict[str, Any], float]:
    """(native scene, owner, true values, values of the start, aspect of the photos)."""
    import jade_pendant

    from selenite.fit_run.plan import build_scene
    from selenite.scene_read.scene import read_scene

    shown = jade_pendant.build(jade_pendant.TRUTH)
    scene = build_scene(read_scene(shown))
    width, height = jade_pendant.RESOLUTION
    return scene, jade_pendant.MATERIAL, jade_pendant.TRUTH, jade_pendant.START, width / height


def synthetic(name: str) -> tuple[Any, str, dict[str, Any], dict[str, Any], float]:
    """The same of a case KIND-SEED of bench/synthetic."""
    kind, _, seed = name.partition("-")
    case = cases.make(kind, int(seed))
    return fits.scene_of(case), fits.scenes.OWNER, case.target, case.start, 1.0


def plan_at(
    scene: Any, owner: str, values: dict[str, Any], captures: list[Capture], settings: FitSettings
) -> FitPlan:
    table = parameters.table()
    unknowns = []
    for name, value in values.items():
        row = table["material", name]
        start = tuple(float(x) for x in np.ravel(value))
        unknowns.append(Unknown(owner, row, start, row.fit_lower, row.fit_upper, 0.03))
    at = scene.with_values({(owner, item.parameter.name): item.start for item in unknowns})
    request = RunRequest("", settings=settings)
    return FitPlan(request, at, captures, unknowns, [], [], "", None)


def photos(scene: Any, aspect: float, settings: FitSettings, spp: int) -> list[Capture]:
    height, width = settings.height, round(settings.height * aspect)
    found = []
    for index, camera in enumerate(scene.cameras):
        film = native.core().render(scene, camera, width, height, spp, seed=_PHOTO_SEED + index)
        weight = np.ones((height, width), np.float32)
        picture = np.ascontiguousarray(film.image, np.float32)
        found.append(Capture(camera, "own", (width, height), picture, weight, width / height))
    return found


def measure(name: str, settings: FitSettings, seeds: int, spp: int) -> None:
    scene, owner, true, start, aspect = demo() if name == "demo" else synthetic(name)
    shown = plan_at(scene, owner, true, [], settings).scene
    captures = photos(shown, aspect, settings, spp)
    truth = plan_at(scene, owner, true, captures, settings)
    begin = time.process_time()
    looks = Looks(truth, truth.scene)
    for _ in looks.at_photos():
        pass
    took = time.process_time() - begin
    expected = errors_of(looks, settings)
    off = {item.name: [] for item in truth.unknowns}
    told = {item.name: [] for item in truth.unknowns}
    seconds = []
    for seed in range(seeds):
        own = FitSettings(**{**settings.as_json(), "seed": seed})
        plan = plan_at(scene, owner, start, captures, own)
        job = FitJob(plan)
        job.start()
        job.join()
        result = job.result()
        seconds.append(result["cpu_seconds"])
        values = fitted_values(plan, result)
        for item in truth.unknowns:
            off[item.name].append(choices.error_of(item, values[owner, item.parameter.name]))
            report = result["report"]["parameters"][item.name]
            if all(report["determined"]):
                size = np.asarray(report["standard_error"])
                size = size / item.start if item.by_ratio else size
                told[item.name].append(float(np.sqrt(np.mean(size**2))))
    print(
        f"{name}: {settings.height} px, {settings.iterations} x {settings.spp}, {seeds} fits of "
        f"{np.mean(seconds):.1f} CPU s, look {took:.1f} CPU s, photos off by {looks.relative:.3f}"
    )
    for item, error in zip(truth.unknowns, expected, strict=True):
        errors = np.array(off[item.name])
        shown_error = "not determined" if error is None else f"{error:.5f}"
        many = f"{np.median(told[item.name]):.5f}" if told[item.name] else "-"
        print(
            f"  {item.parameter.name:14} expected {shown_error:>14}  told {many:>8} "
            f"({len(told[item.name])})  measured {np.sqrt(np.mean(errors**2)):.5f}  "
            f"worst {errors.max(initial=0):.5f}",
            flush=True,
        )


def main() -> int:
    parser = argparse.ArgumentParser(prog="./dev bench expected", description=__doc__)
    usual = ["demo", "opaque-0", "glass-0"]
    parser.add_argument("cases", nargs="*", default=usual, help="demo, or KIND-SEED: opaque-0")
    parser.add_argument("--height", type=int, default=64)
    parser.add_argument("--iterations", type=int, default=40)
    parser.add_argument("--spp", type=int, default=4)
    parser.add_argument("--photo-spp", type=int, default=1024)
    parser.add_argument("--seeds", type=int, default=8)
    options = parser.parse_args()
    settings = FitSettings(
        iterations=options.iterations, spp=options.spp, height=options.height, threads=1
    )
    for name in options.cases:
        measure(name, settings, options.seeds, options.photo_spp)
    return 0


if __name__ == "__main__":
    sys.exit(main())
