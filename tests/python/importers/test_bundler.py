# SPDX-License-Identifier: GPL-3.0-or-later
"""bundle.out, whose cameras look along -z with y up."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from selenite.importers.read import read_reconstruction
from selenite.importers.reconstruction import ReconstructionError

sys.path.insert(0, str(Path(__file__).parent))

from known import (  # noqa: E402
    FLIP,
    HEIGHT,
    MOST,
    POINTS,
    WIDTH,
    Known,
    Lens,
    known,
    picture,
    seen,
    text,
    worst,
)

LENS = Lens(520.0, 520.0, k1=-0.11, k2=0.04)
CAMERAS = known(lens=LENS)


def camera(one: Known) -> str:
    rows = "\n".join(text(line) for line in FLIP @ one.rotation)
    return f"{text(np.array([LENS.fx, LENS.k1, LENS.k2]))}\n{rows}\n{text(FLIP @ one.translation)}"


def document(cameras: list[str], points: str = "", count: int = 0) -> str:
    return "\n".join(["# Bundle file v0.3", f"{len(cameras)} {count}", *cameras, points])


def written(folder: Path, content: str, names: list[str] | None = None) -> Path:
    for one in CAMERAS:
        picture(folder / one.label)
    path = folder / "bundle.out"
    path.write_text(content)
    if names is not None:
        (folder / "list.txt").write_text("\n".join(names) + "\n")
    return path


NAMES = [one.label for one in CAMERAS]
GOOD = document([camera(one) for one in CAMERAS])


@pytest.mark.parametrize("after", ["", " 0 520.25"])
def test_reprojection(tmp_path: Path, after: str) -> None:
    path = written(tmp_path, GOOD, [name + after for name in NAMES])
    assert worst(read_reconstruction(path), CAMERAS) < MOST
    assert worst(read_reconstruction(tmp_path), CAMERAS) < MOST


def test_the_manuals_own_formula_agrees(tmp_path: Path) -> None:
    """P = R X + t, p = -P / P.z, p' = f r(p) p, from the middle of the photo with y up."""
    found = read_reconstruction(written(tmp_path, GOOD, NAMES))
    for one, read in zip(CAMERAS, found.cameras, strict=True):
        at = (FLIP @ one.rotation) @ POINTS.T + (FLIP @ one.translation)[:, None]
        p = -at[:2] / at[2]
        r2 = (p * p).sum(axis=0)
        x, y = LENS.fx * (1 + LENS.k1 * r2 + LENS.k2 * r2**2) * p
        pixels = np.stack([WIDTH / 2 + x, HEIGHT / 2 - y], axis=-1)
        assert np.abs(seen(read, POINTS) - pixels).max() < MOST


def test_points_and_cameras_without_pose(tmp_path: Path) -> None:
    zero = "\n".join(["0 0 0"] * 5)
    content = document([camera(CAMERAS[0]), zero], "1 2 3.5\n255 0 0\n1 0 0 1.5 2.5\n", 1)
    found = read_reconstruction(written(tmp_path, content, NAMES[:2]))
    assert worst(found, CAMERAS[:1]) < MOST
    np.testing.assert_array_equal(found.points, [[1, 2, 3.5]])
    assert found.remarks == ("camera 'IMG_0001.JPG': it has no pose: its focal length is 0",)


@pytest.mark.parametrize(
    ("content", "names", "cause"),
    [
        (GOOD, NAMES[:2], "2 photos for 5 cameras"),
        (GOOD, None, "no list says which they are"),
        (GOOD, [f"gone{n}.jpg" for n in range(5)], "size of its photo is not known"),
        (GOOD, [NAMES[0]] * 5, "comes twice"),
        (GOOD.replace("5 0\n", "5\n", 1), NAMES, "1 numbers instead of 2"),
        (GOOD.replace("5 0\n", "-5 0\n", 1), NAMES, "cannot be read"),
        (GOOD.replace("5 0\n", "5 99999999999\n", 1), NAMES, "32 bits"),
        (GOOD.replace("5 0\n", "5 7\n", 1), NAMES, "ends too early"),
        (GOOD.replace("520.0", "nan", 1), NAMES, "no usable number"),
        (GOOD.replace("520.0", "-520.0", 1), NAMES, "fx is -520"),
        (GOOD.replace("520.0", "1 2", 1), NAMES, "4 numbers instead of 3"),
        (document(["\n".join(["1 0 0"] * 5)]), NAMES[:1], "right angles"),
        (document(["\n".join(["0 0 0"] * 5)]), NAMES[:1], "none can be used"),
        ("# Bundle file v0.3\n", NAMES, "ends too early"),
    ],
)
def test_a_broken_file_is_refused(
    tmp_path: Path, content: str, names: list[str] | None, cause: str
) -> None:
    with pytest.raises(ReconstructionError) as caught:
        read_reconstruction(written(tmp_path, content, names))
    assert cause in caught.value.cause and caught.value.cure and "\n" not in str(caught.value)
