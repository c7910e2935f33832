# SPDX-License-Identifier: GPL-3.0-or-later
"""What is said of many photos alike is one line."""

from __future__ import annotations

from selenite.commands.grouping import grouped
from selenite.messages import phrase, remark, thing
from selenite.problems import Problem


def of_photo(name: object, text: str) -> str:
    return remark(thing("Photo", name), text)


def test_what_is_said_of_many_photos_is_one_line() -> None:
    lines = [
        Problem(thing("Photo", f"/a/{n}.png"), "the file does not exist", "correct the path").line()
        for n in range(63)
    ]
    (line,) = grouped(lines)
    assert line == (
        "63 photos ('0.png', '1.png', '2.png' and 60 more): the file does not exist; correct the "
        "path"
    )


def test_numbers_become_ranges() -> None:
    said = "{}% of its pixels are clipped (from 0.997) and do not count"
    shares = ("2.5", "0.3", "11.0", "4.1")
    lines = [of_photo(f"{n}.png", said.format(share)) for n, share in enumerate(shares)]
    assert grouped(lines) == [
        "4 photos ('0.png', '1.png', '2.png' and 1 more): 0.3 to 11.0% of its pixels are clipped "
        "(from 0.997) and do not count"
    ]


def test_few_lines_and_other_lines_stay_as_they_are() -> None:
    lines = ["the world is black", of_photo("a", "it is dark"), of_photo("b", "it is dark")]
    lines += [of_photo("c", "it is bright"), "the world is black, twice"]
    assert sorted(grouped(lines)) == sorted(lines)
    assert grouped(lines)[0] == "the world is black"
    parts = [
        remark(
            phrase("{about}, background", about=thing("Photo", n)),
            f"it is {n}, neither border nor R,G,B",
        )
        for n in range(5)
    ]
    assert grouped(parts)[0].startswith("5 photos ('0', '1', '2' and 2 more), background: it is 0 ")
