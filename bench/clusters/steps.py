# SPDX-License-Identifier: GPL-3.0-or-later
"""What `./dev bench cluster` measures and prints."""

from __future__ import annotations

import argparse
import os
import statistics
import time
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from selenite import native
from selenite.capture.prepared import Capture
from selenite.fit.cluster.address import Address
from selenite.fit.cluster.opened import opened
from selenite.fit.cluster.parcel import parcel_of
from selenite.fit.cluster.scheduler import connected
from selenite.fit.cluster.workers import ClusterWorkers
from selenite.fit.job import FitJob
from selenite.fit.plan import FitPlan, build_scene, prepare
from selenite.fit.request import RunRequest, UnknownRequest
from selenite.fit.settings import FitSettings

from .cores import pin
from .model import Model, Parts

if TYPE_CHECKING:
    from distributed import Client

#: Share of a step that a worker may cost, and by how much the prediction for two may be off.
_LIMIT, _WITHIN = 0.05, 0.10
_WORKERS = (1, 2, 4, 8, 16, 32, 64, 128, 256)
#: Bytes a second and seconds of a link: name -> both.
_LINKS = {"1 Gbit/s": (125e6, 2e-4), "10 Gbit/s": (1.25e9, 1e-4)}
#: Steps before those that are measured: workers begin, weights are learned.
_WARM = 2
_PHOTO_SEED = 987654321


def plan_of(options: argparse.Namespace) -> FitPlan:
    """A fit of the demo's pendant to so many photos."""
    import jade_pendant as demo

    from selenite.scene_read.scene import read_scene

    truth = build_scene(read_scene(demo.build(demo.TRUTH)))
    values = read_scene(demo.build(demo.START))
    width, height = demo.RESOLUTION
    size = (round(options.height * width / height), options.height)
    captures = []
    for index in range(options.photos):
        camera = values.cameras[index % len(values.cameras)].name
        film = native.core().render(truth, camera, *size, 64, seed=_PHOTO_SEED + index)
        picture = np.ascontiguousarray(film.image, np.float32)
        weight = np.ones(picture.shape[:2], np.float32)
        name = f"{camera} {index}"
        captures.append(Capture(name, camera, "own", size, picture, weight, size[0] / size[1]))
    unknowns = tuple(UnknownRequest(demo.MATERIAL, name) for name in ("base_color", "roughness"))
    settings = FitSettings(
        height=options.height, iterations=options.steps + _WARM, spp=options.spp, tolerance=0.0,
        search="off", threads=1, until_converged=False,
    )  # fmt: skip
    request = RunRequest("demo", unknowns, settings=settings)
    return prepare(values, request, captures_at=lambda _: captures)


def step_seconds(plan: FitPlan, steps: int, workers: object = None) -> float:
    """Of a step of the descent, the mean of so many, without those at the beginning."""
    job = FitJob(plan, workers=workers)
    job.start()

    def reached(iteration: int) -> float:
        while (state := job.progress()).running and state.iteration < iteration:
            if state.phase != "descent":
                job.cancel()
                raise RuntimeError(
                    f"the fit converged after {state.iteration} steps: ask for fewer"
                )
            time.sleep(0.002)
        return time.perf_counter()

    begin = reached(_WARM)
    end = reached(_WARM + steps)
    job.cancel()
    job.join()
    return (end - begin) / steps


class Here:
    """Workers of this process, which answer when they are asked for: the times of the parts."""

    busy_with = 64  # all photos of a step are known at its begin

    def __init__(self, plan: FitPlan) -> None:
        self._worker, _ = opened(parcel_of(plan).data, 1)
        self._asked: dict[int, bytes] = {}
        self.parts: list[Parts] = []

    def ask(self, question: bytes, _work: float) -> int:
        number = len(self._asked) + 1
        self._asked[number] = question
        return number

    def answer(self, number: int, _seconds: float) -> bytes:
        question = self._asked[number]
        begin = time.perf_counter()
        found = self._worker.answer(question)
        self.parts.append(Parts(time.perf_counter() - begin, len(question), len(found)))
        return found

    def forget(self, _number: int) -> None:
        """They have not begun."""


def parts_of(plan: FitPlan, steps: int) -> tuple[float, list[list[Parts]], float]:
    """Seconds of a step in this process, its batches, and seconds of the fit for a picture."""
    here = Here(plan)
    whole = step_seconds(plan, steps, here)
    photos = len(plan.captures)
    batches = [here.parts[i : i + photos] for i in range(0, len(here.parts), photos)]
    # The first steps are not measured; a batch that the end has cut short is not whole.
    batches = [one for one in batches if len(one) == photos][-_batches(steps) :]
    rendering = sum(part.seconds for one in batches for part in one)
    return whole, batches, (whole * steps - rendering) / (len(batches) * photos)


def _batches(steps: int) -> int:
    """Of steps and of validations, one before every fifth step."""
    every = int(FitSettings().native().get("validation_interval", 5))
    return sum(1 + (index % every == 0) for index in range(_WARM, _WARM + steps))


def way_of(client: Client, size: int) -> tuple[float, float]:
    """Seconds of a small question to a worker and back, and of one among many."""

    def asked(count: int) -> float:
        begin = time.perf_counter()
        futures = [client.submit(bytes, size, pure=False) for _ in range(count)]
        for future in futures:
            future.result()
        return time.perf_counter() - begin

    asked(8)
    return statistics.median(asked(1) for _ in range(9)), asked(64) / 64


def by_workers_of(plan: FitPlan, count: int, steps: int) -> tuple[float, float, float]:
    """Seconds of a step with so many workers of a core each, and of questions as of way_of."""
    with connected(Address(local=count)) as client:
        for core, name in enumerate(
            client.scheduler_info()["workers"], (os.cpu_count() or 1) - count
        ):
            client.run(pin, core, workers=[name])
        workers = ClusterWorkers(client, parcel_of(plan), threads=1)
        return step_seconds(plan, steps, workers), *way_of(client, 1000)


def main(about: str) -> int:
    """Prints the tables. about: of the bench."""
    asked = argparse.ArgumentParser(prog="./dev bench cluster", description=about)
    add = asked.add_argument
    add("--photos", type=int, default=8, help="(%(default)s)")
    add("--height", type=int, default=64, help="pixels of the photos (%(default)s)")
    add("--spp", type=int, default=8, help="samples of a step (%(default)s)")
    add("--steps", type=int, default=6, help="that are measured (%(default)s)")
    add("--rounds", type=int, default=5, help="(%(default)s)")
    options = asked.parse_args()
    plan = plan_of(options)
    plain: list[float] = []
    parts: list[tuple[float, list[list[Parts]], float]] = []
    one: list[tuple[float, float, float]] = []
    two: list[float] = []
    for _ in range(options.rounds):
        plain.append(step_seconds(plan, options.steps))
        parts.append(parts_of(plan, options.steps))
        one.append(by_workers_of(plan, 1, options.steps))
        two.append(by_workers_of(plan, 2, options.steps)[0])
    whole, batches, each = min(parts, key=lambda item: item[0])
    by_one, way, asking = min(one)
    from_parts = Model(batches, options.steps, each, way, asking)
    model = from_parts.calibrated(by_one)
    received = sum(part.received for batch in batches for part in batch) / options.steps
    sent = sum(part.sent for batch in batches for part in batch) / options.steps
    step, by_two, predicted = min(plain), min(two), model.step(2)
    print(f"one process: {step:.3f} s a step ({_listed(plain)})")
    print(f"its parts: {whole:.3f} s, of these {each * 1e3:.2f} ms of the fit for a picture")
    print(f"a question: {way * 1e3:.1f} ms to a worker and back, {asking * 1e3:.2f} ms among many")
    print(f"bytes of a step: {sent / 1e3:.0f} kB to workers, {received / 1e3:.0f} kB back")
    print(
        f"1 worker: {by_one:.3f} s a step ({_listed(item[0] for item in one)}), "
        f"{from_parts.step(1):.3f} by the parts"
    )
    print(f"2 workers: {by_two:.3f} s a step ({_listed(two)}), {predicted:.3f} predicted")
    overhead, off = by_one / step - 1, predicted / by_two - 1
    print(f"overhead of one worker: {overhead:+.1%} (limit {_LIMIT:.0%})")
    print(f"error of the prediction for two: {off:+.1%} (limit {_WITHIN:.0%})")
    for name, (bandwidth, latency) in _LINKS.items():
        print(f"\nsimulated, {name}: how much faster than one process")
        print("| workers | " + " | ".join(f"{n} photos" for n in (8, 64, 512)) + " |")
        print("|---|---|---|---|")
        for count in _WORKERS:
            cells = []
            for photos in (8, 64, 512):
                of = model.of_photos(photos)
                alone = step * photos / options.photos
                cells.append(f"{alone / of.step(count, bandwidth, latency):.1f}")
            print(f"| {count} | {' | '.join(cells)} |")
    return int(overhead > _LIMIT or abs(off) > _WITHIN)


def _listed(seconds: Iterable[float]) -> str:
    return " ".join(f"{one:.3f}" for one in seconds)
