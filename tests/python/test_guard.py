# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench guard`: what a row says of a result, and what counts as a loss."""

from __future__ import annotations

import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "bench")]

from guard import compare, measure, processor, shapes  # noqa: E402
from guard.bodies import BODIES  # noqa: E402

TARGET = {"base_color": (0.5, 0.4, 0.2), "transmission": (0.0,)}


def entry(value, intervals, determined):
    return {"value": value, "interval_90": intervals, "determined": determined}


def result(colour, transmission):
    parameters = {"Body:base_color": colour, "Body:transmission": transmission}
    return {"parameters": parameters, "cpu_seconds": 12.0, "stopped_because": "converged"}


def row(name="vase", seed=1, error=0.02, seconds=10.0, **more):
    return {
        "what": "fit", "name": name, "seed": str(seed), "determined_error": str(error),
        "mean_error": str(error), "cpu_seconds": str(seconds), "right": 1, "intervals": 4,
        "hold": 4, "undetermined": "", "unsaid": "", "stopped": "converged", **more,
    }  # fmt: skip


def test_a_value_called_undetermined_spoils_no_error_and_counts_as_no_interval() -> None:
    intervals = [[0.45, 0.6], [0.41, 0.43], None]
    found = measure.judged(
        TARGET, result(entry([0.5, 0.42, 0.3], intervals, False), entry(0.02, [0.0, 0.05], True))
    )
    assert (found["intervals"], found["hold"]) == (3, 2)
    assert found["undetermined"] == "base_color[2]"
    assert found["unsaid"] == ""
    assert (found["worst"], float(found["worst_error"])) == ("base_color[2]", 0.5)
    assert float(found["mean_error"]) == pytest.approx((0 + 0.05 + 0.5 + 0.2) / 4)
    assert float(found["determined_error"]) == pytest.approx((0 + 0.05 + 0.2) / 3, abs=1e-4)
    assert not found["right"]


def test_a_fit_without_a_report_leaves_its_values_with_neither() -> None:
    found = measure.judged(
        TARGET, result(entry([0.5, 0.4, 0.2], None, None), entry(0.1, None, None))
    )
    assert found["unsaid"].split() == [*(f"base_color[{i}]" for i in range(3)), "transmission"]
    assert (found["intervals"], found["undetermined"]) == (0, "")
    assert not found["right"]  # a mean of 0.25 that nobody is warned of


@pytest.mark.parametrize(("error", "lost"), [(0.0219, 0), (0.0221, 1)])
def test_an_error_that_grew_by_more_than_a_tenth_is_named(error, lost) -> None:
    then = [row(seed=seed) for seed in (1, 2, 3)]
    found = compare.losses([row(seed=seed, error=error) for seed in (1, 2, 3)], then)
    assert len(found) == lost
    assert all("vase: mean error of determined values" in sentence for sentence in found)


def test_the_spread_of_the_seeds_is_no_loss() -> None:
    then = [row(seed=i, error=error) for i, error in enumerate((0.01, 0.02, 0.03))]
    now = [row(seed=i, error=error) for i, error in enumerate((0.02, 0.03, 0.04))]
    assert compare.losses(now, then) == []
    now = [row(seed=i, error=error) for i, error in enumerate((0.03, 0.04, 0.05))]
    assert len(compare.losses(now, then)) == 1


def test_errors_that_nobody_sees_are_no_loss() -> None:
    assert compare.losses([row(error=0.0049)], [row(error=0.001)]) == []
    assert len(compare.losses([row(error=0.0051)], [row(error=0.001)])) == 1


def test_lost_intervals_time_and_failures_are_named() -> None:
    then = [row("vase"), row("bowl")]
    fewer = compare.losses([row("vase", hold=3), row("bowl")], then)
    assert [sentence.split(",")[0] for sentence in fewer] == [
        "all bodies: intervals that do not hold 1"
    ]
    slower = compare.losses([row("vase", seconds=11.2), row("bowl")], then)
    assert slower == ["vase: CPU seconds 11.2, 10 recorded"]
    failed = compare.losses(
        [{"what": "fit", "name": "vase", "seed": "1", "stopped": "failed: 2"}], []
    )
    assert failed == ["vase, seed 1: failed: 2"]


def race(ours, peer):
    return [
        {
            "what": "race", "name": "race medium", "cpu_seconds": str(ours),
            "peer_seconds": str(peer), "ratio": f"{peer / ours:.3f}",
        }
    ]  # fmt: skip


def test_a_race_is_lost_where_our_time_and_the_ratio_got_worse() -> None:
    then = race(0.2, 0.7)
    assert compare.losses(race(0.21, 0.7), then) == []
    assert compare.losses(race(0.2, 0.54), then) == [], "the peer got faster"
    assert compare.losses(race(0.4, 1.4), then) == [], "the machine was busy"
    lost = compare.losses(race(0.3, 0.7), then)
    assert lost == ["race medium: ratio 2.33 and 0.300 s, 3.50 and 0.200 s recorded"]


def test_the_table_has_the_times_of_both_in_a_race() -> None:
    text = compare.table(race(0.2, 0.6), [race(0.2, 0.7)[0] | {"revision": "abc"}], "AMD 25 avx2")
    assert "| medium | 0.2 (0.200) | 0.6 (0.700) | 3.000 (3.500) |" in text


def test_the_table_has_what_is_recorded_in_brackets() -> None:
    text = compare.table([row(error=0.01)], [row(error=0.02) | {"revision": "abc"}], "AMD 25 avx2")
    assert "AMD 25 avx2; recorded: abc" in text
    assert "| vase | 1 | 0.0100 (0.0200) |" in text
    assert "| 4/4 (4/4) |" in text


def test_processors_of_a_kind_share_a_record(monkeypatch) -> None:
    zen = "vendor_id\t: AuthenticAMD\ncpu family\t: 25\nmodel\t: 17\nflags\t: sse avx2 avx512f\n"
    monkeypatch.delenv("SELENITE_AVX2", raising=False)
    assert processor.kind(zen) == processor.kind(zen.replace("17", "33")) == "AMD 25 avx512f"
    assert processor.kind(zen.replace(" avx512f", "")) == "AMD 25 avx2"
    monkeypatch.setenv("SELENITE_AVX2", "0")
    assert processor.kind(zen) == "AMD 25 without avx2"


@pytest.mark.parametrize("name", shapes.SHAPES)
def test_bodies_are_closed_and_face_outwards(name: str) -> None:
    positions, triangles = shapes.standing(shapes.SHAPES[name]())
    edges = Counter(
        (int(a), int(b)) for face in triangles for a, b in zip(face, np.roll(face, -1), strict=True)
    )
    assert set(edges.values()) == {1}
    assert all((b, a) in edges for a, b in edges)
    corners = positions[triangles]
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    assert volume > 0.1
    assert positions[:, 2].min() == pytest.approx(1e-3)


def test_five_bodies_are_media_and_one_is_opaque_with_its_transmission_fitted() -> None:
    assert sum("extinction" in body.target for body in BODIES) == len(BODIES) / 2 == 5
    assert any(body.target.get("transmission") == (0.0,) for body in BODIES)
    assert all(set(body.target) == set(body.start) for body in BODIES)


def test_avx2_can_be_forbidden_by_the_environment() -> None:
    program = (
        "import numpy as np\nfrom selenite import native\ncore = native.core()\n"
        "b = core.SceneBuilder()\nb.set_world((1, 1, 1), 1.0, None)\n"
        "print(core.lanes_obstacle(b.build()))"
    )
    said = []
    for value in ("1", "0"):
        done = subprocess.run(
            [sys.executable, "-c", program], capture_output=True, text=True, check=True,
            cwd=ROOT / "addon", env={**os.environ, "SELENITE_AVX2": value},
        )  # fmt: skip
        said.append(done.stdout.strip())
    assert said[1] == "this processor or this build has no AVX2"
    if "avx2" in Path("/proc/cpuinfo").read_text(encoding="utf-8").split():
        assert said[0] != said[1]
