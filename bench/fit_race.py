# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench fit-race`: CPU time until a fit is within 5 % of the truth, against Mitsuba 3.

Selenite's default fit against Adam on the dual-buffer loss, the recipe of the 2022 thesis
(bench/peer/mitsuba_fit.py says what is kinder here). Both get the same mesh, light, camera, start
and target, in turns on the same machine with one thread each, and each fits a photo that it has
rendered itself: what the models differ in does not count. Time is that of the process, without
loading the scene. The answer of a fit that is stopped is what it would return: Selenite's best
values by its own validation; Mitsuba's last values, and beside them those of its smallest loss.
A fit has arrived when it stays within 5 % until the run ends, and Mitsuba, whose run is cut off,
for at least a quarter as long again: on its way a fit may pass the truth. Mitsuba stops at --times
as long as Selenite took to arrive, or when it has stayed for half as long again. What is in the
table is not done again.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "bench")]

from synthetic import cases, fits, photos, race_report, table  # noqa: E402

from selenite.fit.settings import PRESETS, with_overrides  # noqa: E402

_POLL = 0.005  # seconds between two polls of a running fit
_SIDE = ROOT / "bench" / "peer" / "mitsuba_fit.py"


def ours(case, options):
    """{"seconds", "errors"} of Selenite: a point per iteration, the last one after refinement."""
    scene = fits.scene_of(case)
    wanted = photos.Wanted(options.size, options.photo_spp, "selenite")
    pictures = photos.take(case, scene, wanted, options.out / "photos")
    given = {"iterations": options.iterations, "spp": options.spp}
    settings = with_overrides(PRESETS["balanced"], given).native()
    settings |= {"threads": 1, "seed": 1000 + case.seed}
    job = fits.job_of(case, scene, pictures, settings)
    seconds, errors = [], []

    def note():
        answer = fits.answer_of(job.result().values_best)
        errors.append(cases.mean_error(case, answer))
        seconds.append(time.process_time() - begin)

    begin = time.process_time()
    job.start()
    seen = None
    while (state := job.progress()).running:
        now = state.phase, state.iteration
        if now != seen:
            seen = now
            note()
        time.sleep(_POLL)
    job.join()
    note()
    if problems := job.result().problems:
        raise RuntimeError(f"{case.name}: {'; '.join(item.cause for item in problems)}")
    return {"seconds": seconds, "errors": errors}


def theirs(case, spp, budget, options):
    """{"seconds", "errors", "losses", "compiling"} of Mitsuba: a point per iteration."""
    name = f"{case.photos}-{options.size}-{options.photo_spp}-mitsuba.npy"
    photo = options.out / "photos" / name
    with tempfile.TemporaryDirectory(prefix="selenite-race-") as place:
        folder = Path(place)
        request = {
            "kind": case.kind,
            "seed": case.seed,
            "bounds": fits.bounds_of(case),
            "size": options.size,
            "spp": spp,
            "photo_spp": options.photo_spp,
            "budget": budget,
            "level": race_report.LEVEL,
            "folder": place,
            "photo": str(photo),
            "curve": str(folder / "curve.json"),
        }
        (folder / "request.json").write_text(json.dumps(request), encoding="utf-8")
        for what in ("fit",) if photo.exists() else ("photo", "fit"):
            # An empty home: compiled kernels are kept there, and the first fit pays for them.
            home = folder / f"home-{what}"
            home.mkdir()
            environment = {**os.environ, "HOME": str(home), "PYTHONDONTWRITEBYTECODE": "1"}
            command = [options.peer_python, _SIDE, what, folder / "request.json"]
            subprocess.run([str(word) for word in command], check=True, env=environment)
        return json.loads((folder / "curve.json").read_text(encoding="utf-8"))


def run(case, options, rows):
    """Adds what is lacking of a case to the table."""
    keep = options.out / "curves"
    keep.mkdir(parents=True, exist_ok=True)
    found = {row["recipe"]: row for row in rows if row["case"] == case.name}

    def add(recipe, curve):
        path = keep / f"{case.photos}-{recipe.replace(' ', '-')}.json"
        path.write_text(json.dumps(curve), encoding="utf-8")
        row = race_report.row(case, recipe, curve, path.relative_to(options.out))
        table.append(options.out / "race.csv", row, race_report.COLUMNS)
        rows.append(row)
        print(race_report.line(row), file=sys.stderr, flush=True)
        return row

    own = found.get(race_report.OURS) or add(race_report.OURS, ours(case, options))
    budget = options.cap
    if own["converged"]:
        budget = min(budget, options.times * float(own["converged"]))
    for spp in options.peer_spp or [4]:
        recipe = f"Mitsuba 2x{spp}"
        if recipe not in found:
            add(recipe, theirs(case, spp, budget, options))


def parse():
    parser = argparse.ArgumentParser(prog="./dev bench fit-race", description=__doc__)
    add = parser.add_argument
    kinds = ("opaque", "glass", "half", "medium")
    add("kind", nargs="*", help=f"of {', '.join(cases.KINDS)} ({', '.join(kinds)})")
    add("--peer-python", type=Path, required=True, help="Python of the environment with Mitsuba")
    add("--seeds", type=int, default=1, help="per kind, each with one camera (%(default)s)")
    add("--size", type=int, default=96, help="pixels, square (%(default)s)")
    add("--photo-spp", type=int, default=1024, help="samples of a photo (%(default)s)")
    add("--iterations", type=int, help="of Selenite (its default)")
    add("--spp", type=int, help="of a step of Selenite (its default)")
    add("--peer-spp", type=int, action="append", help="of each of two renders; repeatable (4)")
    add("--times", type=float, default=20.0, help="Selenite's time for Mitsuba (%(default)s)")
    add("--cap", type=float, default=600.0, help="CPU seconds of Mitsuba at most (%(default)s)")
    add("--report-only", action="store_true", help="table and plot of what has been done")
    add("--out", type=Path, default=ROOT / "build" / "fit-race", help="(%(default)s)")
    options = parser.parse_args()
    options.kind = options.kind or kinds
    wrong = [kind for kind in options.kind if kind not in cases.KINDS]
    if wrong:
        parser.error(f"kind '{wrong[0]}' is unknown; choose of {', '.join(cases.KINDS)}")
    options.out = options.out.resolve()
    return options


def main():
    options = parse()
    rows = table.read(options.out / "race.csv")
    # Every fourth case has four cameras; the recipe's loop over cameras is not part of this.
    seeds = [seed for seed in range(2 * options.seeds) if seed % 4 != 3][: options.seeds]
    for seed in () if options.report_only else seeds:
        for kind in options.kind:
            run(cases.make(kind, seed), options, rows)
    race_report.show(table.read(options.out / "race.csv"), options.out)
    return 0


if __name__ == "__main__":
    status = main()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)
