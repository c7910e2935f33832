# SPDX-License-Identifier: GPL-3.0-or-later
"""What `./dev package` makes for which platform."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "devtools"))

import cross  # noqa: E402
import package  # noqa: E402


@pytest.fixture
def manifest(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """That of an extension that is made without Blender and without wheels."""
    monkeypatch.setattr(package, "WORK", tmp_path)
    monkeypatch.setattr(package, "run", lambda _command: None)
    return tmp_path / "extension-macos-arm64" / "blender_manifest.toml"


@pytest.mark.parametrize("tried", ["", cross.MACOS.tried])
def test_a_manifest_says_where_its_modules_never_ran(
    manifest: Path, tmp_path: Path, tried: str
) -> None:
    package._extension([], [], cross.MACOS.in_blender, tmp_path / "made.zip", tried)
    text = manifest.read_text(encoding="utf-8")
    assert 'platforms = ["macos-arm64"]\n' in text
    assert text.count("never run") == bool(tried)


def test_each_platform_says_what_was_tried_and_has_a_section() -> None:
    page = (ROOT / "docs" / "measurements" / "packages.md").read_text(encoding="utf-8")
    for platform in cross.PLATFORMS.values():
        assert "never run" in platform.tried
    assert "\n## Windows, by Wine\n" in page and "\n## macOS\n" in page
