# SPDX-License-Identifier: GPL-3.0-or-later
"""What a check in Cycles is asked, and what it says: key `cycles` of result.json."""

from __future__ import annotations

from typing import TypedDict


class GridFile(TypedDict):
    """A grid whose numbers are in a file of the process's folder."""

    name: str
    file: str
    to_unit: list[list[float]]


class CheckRequest(TypedDict):
    """See `CheckJob`. scripts: whether the file's run. taken: gain and alignment by photo."""

    scene: str
    scripts: bool
    run: dict[str, object]
    values: dict[str, list[float]]
    grids: dict[str, dict[str, GridFile]]
    surfaces: dict[str, str]
    taken: dict[str, dict[str, list[float]]]
    environment: str


class MisfitRow(TypedDict):
    """Of two pictures, relative to the mean of the second: see `compare.misfit`."""

    relative_bias: float
    relative_bias_noise: float
    relative_bias_beyond_noise: float
    relative_bias_rgb: list[float]
    relative_rmse: float
    relative_rmse_noise: float
    relative_rmse_beyond_noise: float


class CheckedPhoto(TypedDict):
    """Of one photo, over its mask."""

    native_against_cycles: MisfitRow
    native_against_photo: MisfitRow
    cycles_against_photo: MisfitRow


class RemarkRow(TypedDict):
    """A `render_settings.Remark`."""

    name: str
    value: str
    wanted: str
    cost: str
    spoils: bool


class CheckReport(TypedDict):
    """samples: of Cycles, by all seeds. blender: its version. shown: how fitted fields are."""

    samples: int
    seeds: int
    blender: str
    seconds: float
    photos: dict[str, CheckedPhoto]
    shown: list[str]
    render_settings: list[RemarkRow]
