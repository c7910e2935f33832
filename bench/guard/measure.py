# SPDX-License-Identifier: GPL-3.0-or-later
"""A fit through the command line as a row of the table, and the race."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
from synthetic.cases import errors_of, seen

from .bodies import Body
from .photos import Kept

ROOT = Path(__file__).resolve().parents[2]
CHECK = ROOT.parent / "shared" / "check" / "peer"
#: A fit counts as right with a mean error up to here.
RIGHT = 0.05
_LIMIT = 1200  # seconds for a fit
_RACE = ("opaque", "glass", "half", "medium")
Row = dict[str, Any]


def fit(body: Body, kept: Kept, seed: int, out: Path) -> Row:
    """The row of a default fit with one thread; one that fails has the reason in `stopped`."""
    command = [sys.executable, "-m", "selenite", "fit", kept.scene, "--fit", body.fitted]
    for camera, photo in kept.photos.items():
        command += ["--photo", f"{camera}={photo}"]
    command += ["--seed", seed, "--threads", 1, "--picture-spp", 1, "--out", out, "--json"]
    row = {"what": "fit", "name": body.name, "seed": str(seed)}
    try:
        done = subprocess.run(
            [str(word) for word in command], stdin=subprocess.DEVNULL, capture_output=True,
            text=True, timeout=_LIMIT, check=False, cwd=ROOT / "addon",
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return row | {"stopped": f"failed: took more than {_LIMIT} s"}
    if done.returncode:
        last = (done.stderr.strip().splitlines() or ["nothing was said"])[-1]
        return row | {"stopped": f"failed: status {done.returncode}: {last[:200]}"}
    return row | judged(body.target, json.loads(done.stdout.strip().splitlines()[-1]))


def judged(target: dict[str, tuple[float, ...]], result: dict[str, Any]) -> Row:
    """Errors and intervals of a result.json.

    determined_error: mean over the scalars that are not called undetermined, empty without one.
    Where photos do not tell a value, its error is luck. right: 1 where it, or the mean over all, is
    at most RIGHT. unsaid: values that have no interval and are not called undetermined.
    """
    entries = {name: result["parameters"][f"Body:{name}"] for name in target}
    found = errors_of(target, {name: entry["value"] for name, entry in entries.items()})
    given = holding = 0
    undetermined: list[str] = []
    unsaid: list[str] = []
    for name, truth in target.items():
        intervals = entries[name]["interval_90"]
        if len(truth) == 1 and intervals is not None:
            intervals = [intervals]
        for i, true in enumerate(truth):
            label = f"{name}[{i}]" if len(truth) > 1 else name
            interval = intervals[i] if intervals is not None else None
            if interval is not None:
                given += 1
                holding += bool(
                    seen(name, interval[0]) <= seen(name, true) <= seen(name, interval[1])
                )
            elif entries[name]["determined"] is None:
                unsaid.append(label)
            else:
                undetermined.append(label)
    # An extinction has one error for its channels.
    known = [
        error
        for label, error in found.items()
        if not any(other == label or other.startswith(f"{label}[") for other in undetermined)
    ]
    mean = float(np.mean(list(found.values())))
    determined = float(np.mean(known)) if known else None
    worst = max(found, key=lambda label: found[label])
    return {
        "mean_error": f"{mean:.4f}",
        "worst_error": f"{found[worst]:.4f}",
        "worst": worst,
        "determined_error": "" if determined is None else f"{determined:.4f}",
        "right": int(mean <= RIGHT or determined is None or determined <= RIGHT),
        "intervals": given,
        "hold": holding,
        "undetermined": " ".join(undetermined),
        "unsaid": " ".join(unsaid),
        "cpu_seconds": f"{result['cpu_seconds']:.1f}",
        "stopped": result["stopped_because"],
        "values": " ".join(
            f"{name}={','.join(f'{x:.4g}' for x in np.ravel(entry['value']))}"
            for name, entry in entries.items()
        ),
    }


def race(out: Path) -> tuple[list[Row], str]:
    """Rows with both CPU times and their ratio, or why there are none. RuntimeError where it can
    run and fails."""
    if not (CHECK / "race.py").is_file():
        return [], f"{CHECK.relative_to(ROOT.parent)} is not beside this checkout"
    # Installs Mitsuba and LLVM where they are missing.
    tried = _dev("bench", "race", "--help")
    if tried.returncode:
        return [], _last_line(tried.stderr) or "Mitsuba cannot be installed"
    ran = _dev("bench", "race", *_RACE, "--out", str(out))
    if ran.returncode:
        raise RuntimeError(f"./dev bench race: {_last_line(ran.stderr)}")
    found = json.loads((out / "race_256.json").read_text(encoding="utf-8"))
    return [
        {"what": "race", "name": f"race {row['kind']}", "ratio": f"{row['ratio']:.3f}"}
        | {
            "cpu_seconds": f"{row['selenite_cpu_s']:.4f}",
            "peer_seconds": f"{row['mitsuba_cpu_s']:.4f}",
        }
        for row in found
    ], ""


def _dev(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [str(ROOT / "dev"), *words], stdin=subprocess.DEVNULL, capture_output=True, text=True,
        check=False,
    )  # fmt: skip


def _last_line(text: str) -> str:
    lines = [line for line in text.strip().splitlines() if line.strip()]
    return re.sub(r"^dev: ", "", lines[-1])[:300] if lines else ""
