# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench stages`: fits all at once against fits in stages.

The demo with the photos that Cycles took, and cases of `./dev bench fit` with photos of our own.
Prints CPU seconds and the root mean square error of each parameter over the seeds.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "bench"), str(ROOT / "scenes")]

import numpy as np  # noqa: E402
from synthetic import subjects  # noqa: E402

from selenite.capture.prepared import Capture, read_captures  # noqa: E402
from selenite.fit.plan import FitPlan  # noqa: E402
from selenite.fit.request import RunRequest  # noqa: E402
from selenite.fit.settings import FitSettings  # noqa: E402
from selenite.fit.staging import plan as stage_plan  # noqa: E402
from selenite.fit.staging.plan import Stage  # noqa: E402
from selenite.fit.staging.request import stages_by_name  # noqa: E402

_LONGER = 1.5


def in_stages(plan: FitPlan, request: RunRequest) -> FitPlan:
    """The plan with the stages of a request, all at its height."""
    names = [item.name for item in plan.unknowns]
    own = stage_plan.settings_of(request.stages, names, request.settings, [])
    stages = [
        Stage(item, settings, plan.captures, plan.scene, ())
        for item, settings in zip(request.stages, own, strict=True)
    ]
    return replace(plan, request=request, stages=tuple(stages))


def staged(plan: FitPlan, how: str) -> FitPlan:
    """how: "" for all at once, or a name that --stages knows."""
    if not how:
        return plan
    names = [item.name for item in plan.unknowns]
    found = stages_by_name(how, names, plan.request.settings.iterations, [])
    return in_stages(plan, replace(plan.request, stages=found))


def captures_of(name: str, subject: subjects.Subject, height: int) -> list[Capture]:
    if name != subjects.DEMO:
        return subject.photos(height, 1024)
    import jade_pendant

    from selenite.capture.request import CaptureRequest
    from selenite.scene_read.scene import read_scene

    values = read_scene(jade_pendant.build(jade_pendant.START))
    asked = [
        CaptureRequest(camera, str(jade_pendant.PHOTOS / f"{camera}.png"))
        for camera in jade_pendant.CAMERAS
    ]
    return read_captures(values, asked, height, [], [], {})


def measure(name: str, how: str, settings: FitSettings, seeds: int) -> None:
    subject = subjects.subject(name)
    captures = captures_of(name, subject, settings.height)
    truth = subject.plan(subject.true, captures, settings)
    off: dict[str, list[float]] = {item.name: [] for item in truth.unknowns}
    seconds = []
    for seed in range(seeds):
        plan = staged(subject.plan(subject.start, captures, replace(settings, seed=seed)), how)
        result, sizes = subjects.fit(plan, truth)
        seconds.append(result.cpu_seconds)
        for item, size in sizes.items():
            off[item].append(size)
    errors = "  ".join(
        f"{name.partition(':')[2]} {np.sqrt(np.mean(np.square(sizes))):.4f} "
        f"(worst {max(sizes):.3f})"
        for name, sizes in off.items()
    )
    words = f"{how or 'all at once'}, {settings.iterations}"
    print(f"{name}: {words}: {np.mean(seconds):.1f} CPU s  {errors}", flush=True)


def main() -> int:
    parser = subjects.parser("stages", __doc__, ("demo", "half-0", "glass-2"), seeds=6)
    named = "ior-last,colours-first"
    parser.add_argument("--stages", default=named, help="in addition to all at once (%(default)s)")
    parser.add_argument("--only-stages", action="store_true", help="nothing all at once")
    options = parser.parse_args()
    settings = subjects.settings_of(options)
    longer = replace(settings, iterations=round(_LONGER * options.iterations))
    for name in options.cases:
        if not options.only_stages:
            measure(name, "", settings, options.seeds)
            measure(name, "", longer, options.seeds)
        for how in options.stages.split(","):
            measure(name, how, settings, options.seeds)
    return 0


if __name__ == "__main__":
    sys.exit(main())
