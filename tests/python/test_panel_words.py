# SPDX-License-Identifier: GPL-3.0-or-later
"""Problems in the panel name its controls, and no option of the command line."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
ADDON = ROOT / "addon" / "selenite"
WORDS = ADDON / "interface" / "problem_words.py"

_spec = importlib.util.spec_from_file_location("problem_words", WORDS)
assert _spec is not None and _spec.loader is not None
problem_words = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(problem_words)

#: Texts of the rooms that both the panel and the command line use.
ROOMS = ("scene_read", "capture", "fit", "report", "advice")
OPTION = re.compile(r'"[^"]*--[a-z][^"]*"')


def texts() -> list[str]:
    found = []
    for room in ROOMS:
        for path in sorted((ADDON / room).rglob("*.py")):
            found += OPTION.findall(path.read_text(encoding="utf-8"))
    return found


def test_there_are_texts_with_options() -> None:
    assert len(texts()) >= 5


@pytest.mark.parametrize("text", texts())
def test_no_option_is_left(text: str) -> None:
    shown = problem_words.in_panel_words(text.strip('"'))
    assert "--" not in shown and shown != text.strip('"')


def test_a_missing_photo_names_the_button() -> None:
    cure = "give one with --photo CAMERA=FILE or in the Captures panel"
    shown = problem_words.in_panel_words(cure)
    assert shown == "press Load Photos, or choose one in the list of captures"
