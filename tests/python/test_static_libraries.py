# SPDX-License-Identifier: GPL-3.0-or-later
"""How the packages' static libraries are configured on each platform."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "devtools"))

import cross  # noqa: E402
import static_libraries  # noqa: E402
from process import digest  # noqa: E402


@pytest.mark.parametrize(
    ("platform", "expected"),
    [
        (None, {"SSE42", "AVX", "AVX2"}),
        (cross.WINDOWS, {"SSE42"}),
        (cross.MACOS, {"NEON"}),
    ],
)
def test_embree_has_the_instruction_sets_of_the_platform(
    platform: cross.Platform | None, expected: set[str]
) -> None:
    (embree,) = [one for one in static_libraries.LIBRARIES if one.name == "embree"]
    options = embree.options_for(platform).items()
    on = {name.removeprefix("EMBREE_ISA_") for name, value in options
          if name.startswith("EMBREE_ISA_") and value == "ON"}  # fmt: skip
    assert on == expected


def test_another_checkout_builds_no_library_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = static_libraries.Place(cross.WINDOWS)
    here = digest(place.recipe)
    shutil.copytree(ROOT / "cmake", tmp_path / "cmake")
    monkeypatch.setattr(cross, "ROOT", tmp_path)
    assert digest(place.recipe) == here
    with (tmp_path / "cmake" / "windows.cmake").open("a") as toolchain:
        toolchain.write("# changed\n")
    assert digest(place.recipe) != here
