# SPDX-License-Identifier: GPL-3.0-or-later
"""The comparison of `./dev bench golden`: what differs, what does not count, what was renamed."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "bench")]

from golden import cases, compare, renamed  # noqa: E402

from selenite import native  # noqa: E402

RESULT = {
    "versions": {"selenite": "1"},
    "parameters": {"Body:ior": {"value": 1.45, "interval_90": [1.4, 1.5], "determined": True}},
    "rivals": [{"Body:ior": [1.6]}],
    "samples": 4096,
    "seconds": 2.5,
    "stopped_because": "all iterations done",
}
HISTORY = "iteration,loss,validation\n0,0.25,0.5\n1,0.125,\n"


def results(folder, result=RESULT, history=HISTORY, picture=None, grid=None):
    """A folder as a fit leaves it."""
    (folder / "result").mkdir(parents=True)
    (folder / "done.json").write_text(json.dumps({"seconds": float(len(folder.name))}))
    (folder / "result" / "result.json").write_text(json.dumps(result))
    (folder / "result" / "history.csv").write_text(history)
    if picture is not None:
        native.image().write_exr(str(folder / "result" / "Camera_optimised.exr"), picture)
    np.save(folder / "result" / "grid.npy", np.zeros(3, np.float32) if grid is None else grid)
    return folder


def read(path):
    return native.image().read(path, as_linear=False)[0]


def difference(tmp_path, **changed):
    one, other = results(tmp_path / "one"), results(tmp_path / "another", **changed)
    return compare.difference(one, other, read)


def next_number(value):
    return math.nextafter(value, math.inf)


def test_the_same_results_are_equal(tmp_path):
    assert difference(tmp_path) == ""


def test_the_last_bit_of_a_value_counts(tmp_path):
    row = RESULT["parameters"]["Body:ior"] | {"interval_90": [1.4, next_number(1.5)]}
    found = difference(tmp_path, result=RESULT | {"parameters": {"Body:ior": row}})
    assert found.startswith("result/result.json: /parameters/Body:ior/interval_90[1]: 1.5 before")


@pytest.mark.parametrize(
    ("one", "other"), [(0.0, -0.0), (1, 1.0), (1.0, None), (True, 1), ([1.0], [1.0, 2.0])]
)
def test_what_is_only_nearly_the_same_is_not(one, other):
    assert compare.json_difference({"value": one}, {"value": other}).startswith("/value")


def test_times_and_versions_do_not_count(tmp_path):
    changed = RESULT | {"seconds": 3.5, "versions": {"selenite": "2"}}
    assert difference(tmp_path, result=changed) == ""


def test_a_key_with_a_new_name_is_the_same_and_its_value_counts(tmp_path):
    changed = {renamed.KEYS.get(key, key): value for key, value in RESULT.items()}
    assert "alternative_minima" in changed
    assert compare.json_difference(RESULT, changed) == ""
    changed["alternative_minima"] = []
    assert "/alternative_minima: 1 items before, 0 now" in compare.json_difference(RESULT, changed)
    with pytest.raises(ValueError, match="twice"):
        compare.json_difference(RESULT, changed | {"rivals": []})


def test_a_key_that_is_lost_or_added_counts():
    assert "['gain'] now" in compare.json_difference(RESULT, RESULT | {"gain": 1.0})
    without = {key: value for key, value in RESULT.items() if key != "samples"}
    assert "['samples'] before" in compare.json_difference(RESULT, without)


def test_words_that_have_changed_are_the_same_and_others_are_not():
    assert compare.json_difference(["verifying"], ["refinement"]) == ""
    assert compare.json_difference(["all iterations done"], ["cancelled"]) != ""


def test_counted_paths_can_be_left_out(tmp_path):
    stages = [{"samples": 10, "iterations": 2}]
    one = results(tmp_path / "one", RESULT | {"stages": stages})
    changed = RESULT | {"samples": 5000, "stages": [{"samples": 20, "iterations": 2}]}
    other = results(tmp_path / "two", changed)
    assert compare.difference(one, other, read, ("samples",)) == ""
    assert "stages[0]/iterations" in compare.difference(
        one, results(tmp_path / "three", RESULT | {"stages": [{"iterations": 3}]}), read,
        ("samples",),
    )  # fmt: skip


def test_counted_paths_count_otherwise(tmp_path):
    assert "/samples: 4096" in difference(tmp_path, result=RESULT | {"samples": 5000})


@pytest.mark.parametrize(
    ("history", "words"),
    [
        (HISTORY.replace("0.125", repr(next_number(0.125))), "row 2, loss: 0.125 before"),
        (HISTORY + "2,0.1,0.2\n", "2 rows before, 3 now"),
        (HISTORY.replace("loss", "cost"), "columns"),
        (HISTORY.replace("1,0.125,", "1,0.125"), "row 2: 3 cells before, 2 now"),
    ],
)
def test_a_table_differs_by_a_cell_a_row_or_a_column(tmp_path, history, words):
    assert words in difference(tmp_path, history=history)


def test_a_bit_of_a_grid_counts(tmp_path):
    grid = np.array([0, -0.0, 0], np.float32)
    found = difference(tmp_path, grid=grid)
    assert found.startswith("result/grid.npy: 1 of 3 numbers; at (1,)")


def test_bits_are_compared_where_nothing_is_a_number():
    one = np.array([[np.nan, 1.0]], np.float32)
    assert compare.array_difference(one, one.copy()) == ""
    other = one.copy()
    other[0, 1] = np.nextafter(np.float32(1), np.float32(2))
    assert "at (0, 1)" in compare.array_difference(one, other)
    assert "float64" in compare.array_difference(one, one.astype(np.float64))


def test_a_pixel_of_a_picture_counts(tmp_path):
    pixels = np.full((2, 3, 3), 0.5, np.float32)
    changed = pixels.copy()
    changed[1, 2, 0] = np.nextafter(np.float32(0.5), np.float32(1))
    one = results(tmp_path / "one", picture=pixels)
    assert compare.difference(one, results(tmp_path / "two", picture=pixels), read) == ""
    found = compare.difference(one, results(tmp_path / "three", picture=changed), read)
    assert found.startswith("result/Camera_optimised.exr: 1 of 18 numbers; at (1, 2, 0)")


def test_a_file_that_is_missing_counts(tmp_path):
    one, other = results(tmp_path / "one"), results(tmp_path / "two")
    (other / "result" / "grid.npy").unlink()
    assert "files: ['result/grid.npy'] before, [] now" in compare.difference(one, other, read)
    empty = [tmp_path / "three", tmp_path / "four"]
    assert compare.difference(*empty, read) == "there are no results"


def test_the_drawn_name_of_a_volume_file_does_not_count(tmp_path):
    one, other = results(tmp_path / "one"), results(tmp_path / "two")
    content = bytes(range(80))
    for folder, start in ((one, content[:21]), (other, content[:21])):
        name = folder.name.ljust(36).encode()
        (folder / "result" / "Smoke.vdb").write_bytes(start + name + content[57:])
    assert compare.difference(one, other, read) == ""
    path = other / "result" / "Smoke.vdb"
    path.write_bytes(path.read_bytes()[:-1] + b"\0")
    assert "Smoke.vdb: byte" in compare.difference(one, other, read)


def test_cases_have_names_of_their_own_and_photos_that_are_made():
    names = [case.name for case in cases.CASES]
    assert len(set(names)) == len(names) >= 30
    made = {photo.name for photo in cases.PHOTOS} | {"mask"}
    for case in cases.CASES:
        for word in case.words:
            if word.startswith(("--photo=", "--mask=")):
                assert Path(word).stem in made, case.name
    assert {word for case in cases.CASES for word in case.words if "threads" in word} == {
        "--threads=1", "--threads=2",
    }  # fmt: skip


def test_a_key_that_an_older_revision_lacks_does_not_count() -> None:
    old, new = {"misfit": 1.0}, {"misfit": 1.0, "ambiguous": []}
    assert compare.json_difference(old, new) == ""
    assert compare.json_difference(new, old) != "", "it is not lost again"
    assert compare.json_difference(new, new | {"ambiguous": ["Body:ior"]}) != ""


def test_the_newest_name_of_a_method_is_found() -> None:
    older = type("Recorder", (), {"look": None})
    assert renamed.first_of(older, renamed.UPDATE_RECORD) == "look"
    with pytest.raises(AttributeError, match="none of update, look"):
        renamed.first_of(object(), renamed.UPDATE_RECORD)
