# SPDX-License-Identifier: GPL-3.0-or-later
"""The table and the page of a batch."""

from __future__ import annotations

import csv
import json
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from selenite import native
from selenite.report.batch_page import PAGE, TABLE, Ended, write_pages

BROWSER = shutil.which("chromium") or shutil.which("google-chrome")
RESULT = {
    "parameters": {
        "Cup:base_color": {
            "initial": [0.5, 0.5, 0.5], "value": [0.25, 0.5, 0.75], "determined": True,
            "interval_90": [[0.24, 0.26], [0.49, 0.51], [0.74, 0.76]],
        },
        "Cup:roughness": {
            "initial": 0.5, "value": 0.3, "determined": False, "interval_90": None,
        },
    }
}  # fmt: skip


class Links(HTMLParser):
    """What a page refers to, and its text."""

    def __init__(self) -> None:
        super().__init__()
        self.links: list[str] = []
        self.text = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.links += [value for name, value in attrs if name in ("href", "src") and value]

    def handle_data(self, data: str) -> None:
        self.text += data


@pytest.fixture
def batch(tmp_path: Path) -> list[Ended]:
    folder = tmp_path / "tea cup" / "2026"
    folder.mkdir(parents=True)
    (folder / "result.json").write_text(json.dumps(RESULT), encoding="utf-8")
    (folder / "contact_sheet.png").touch()
    for name in ("reference", "optimised"):
        picture = np.full((20, 30, 3), 0.8 if name == "reference" else 0.2, np.float32)
        native.image().write_png(str(folder / f"Front_{name}.png"), picture)
    return [
        Ended("tea cup", ("a.blend",), "done", "tea cup/2026", (), 12.34),
        Ended("<b>", ("b.blend",), "refused", "", ("File 'b&c': it is missing; look",), 1.0),
        Ended("last", ("c.blend",), "waiting"),
    ]


def test_the_table_has_a_row_for_each_number_and_each_fit(
    batch: list[Ended], tmp_path: Path
) -> None:
    write_pages(tmp_path, batch)
    with (tmp_path / TABLE).open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["fit"] for row in rows] == ["tea cup"] * 4 + ["<b>", "last"]
    green, roughness, refused = rows[1], rows[3], rows[4]
    assert (green["parameter"], green["channel"]) == ("Cup:base_color", "green")
    assert [float(green[key]) for key in ("start", "value", "low", "high")] == [
        0.5, 0.5, 0.49, 0.51,
    ]  # fmt: skip
    assert (roughness["determined"], roughness["low"], roughness["value"]) == ("no", "", "0.3")
    assert (refused["status"], refused["reason"]) == ("refused", batch[1].reasons[0])


def test_the_page_links_what_is_there_and_shows_names_as_they_are(
    batch: list[Ended], tmp_path: Path
) -> None:
    write_pages(tmp_path, batch)
    page = Links()
    page.feed((tmp_path / PAGE).read_text(encoding="utf-8"))
    assert "3 fits: 1 done, 1 refused, 1 waiting" in page.text
    assert "<b> refused: File 'b&c': it is missing; look" in page.text
    assert "0.490 to 0.510" in page.text and "not determined" in page.text
    assert len(page.links) == 6  # table, folder, two pictures with the sheet
    for link in page.links:
        assert (tmp_path / link.replace("%20", " ")).exists(), link


@pytest.mark.skipif(BROWSER is None, reason="no Chromium is installed")
def test_a_browser_shows_the_pictures_beside_the_values(batch: list[Ended], tmp_path: Path) -> None:
    write_pages(tmp_path, batch)
    shot = tmp_path / "shot.png"
    subprocess.run(
        [
            str(BROWSER), "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
            "--window-size=1100,600", f"--screenshot={shot}", (tmp_path / PAGE).as_uri(),
        ],
        check=True, capture_output=True, timeout=120,
    )  # fmt: skip
    pixels = native.image().read(str(shot))[0]
    right = pixels[:, 700:]
    for level in (0.8, 0.2):  # the photo, and the fit
        shown = np.all(np.abs(right - _linear(pixels, level)) < 0.03, axis=-1)
        assert shown.sum() > 5000, level


def _linear(pixels: np.ndarray, level: float) -> float:
    """What a picture holds that was written with a level, in the numbers of the screenshot."""
    return level if pixels.max() <= 1.0 else 255 * level


def test_a_row_is_read_as_it_was_written(batch: list[Ended]) -> None:
    for one in batch:
        assert Ended.of_json(json.loads(json.dumps(one.as_json()))) == one
    with pytest.raises(TypeError):
        Ended.of_json(batch[0].as_json() | {"words": "fit"})
