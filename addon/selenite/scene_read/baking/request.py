# SPDX-License-Identifier: GPL-3.0-or-later
"""What the process that bakes is asked, and what it says of each material."""

from __future__ import annotations

from typing import TypedDict


class OutputRequest(TypedDict):
    """See `WantedOutput`; noisy: it is of chance."""

    groups: list[str]
    node: str
    socket: str
    noisy: bool


class ObjectRequest(TypedDict):
    """slots: whether each has the material."""

    name: str
    library: str
    slots: list[bool]


class MaterialRequest(TypedDict):
    """key: of its folder; size: of its pictures, for `tiles` objects along a side."""

    key: str
    datablock: str
    library: str
    size: int
    tiles: int
    sees_others: bool
    objects: list[ObjectRequest]
    outputs: list[OutputRequest]


class BakeRequest(TypedDict):
    """folder: gets one for each material; partial: where each is made first, on the same disk."""

    scene: str
    scripts: bool
    folder: str
    partial: str
    materials: list[MaterialRequest]


class BakeReport(TypedDict):
    """errors, points: of each output, what pictures are off by and at how many points."""

    size: int
    errors: list[float]
    points: list[int]
