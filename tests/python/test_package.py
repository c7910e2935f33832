# SPDX-License-Identifier: GPL-3.0-or-later
"""What `./dev package` answers before it builds anything."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "devtools"))

import cross  # noqa: E402
import package  # noqa: E402
from process import Failed  # noqa: E402


def test_a_platform_without_a_package_is_refused_with_the_reason(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(package, "_pythons", lambda: pytest.fail("something was built"))
    with pytest.raises(Failed, match="no package for macOS yet: Embree and OpenImageIO have not"):
        package.make(["--platform", "linux", "macos"])
    assert package.UNBUILT.keys() < cross.PLATFORMS.keys()


def test_the_reason_names_a_section_that_is_there() -> None:
    page = (ROOT / "docs" / "measurements" / "packages.md").read_text(encoding="utf-8")
    assert "\n## macOS\n" in page
