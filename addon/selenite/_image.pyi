# SPDX-License-Identifier: GPL-3.0-or-later
"""The types of the native module that reads and writes pictures.

`tests/python/test_native_stubs.py` compares names and parameters with the module.
"""

from collections.abc import Sequence
from os import PathLike
from typing import TypedDict

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: str
largest_picture: int

FilePath = str | bytes | PathLike[str] | PathLike[bytes]
# "srgb", "linear", an exponent, or rows (code value, red, green, blue)
Response = str | float | Sequence[Sequence[float]]

class Problem:
    @property
    def object(self) -> str: ...
    @property
    def cause(self) -> str: ...
    @property
    def cure(self) -> str: ...

class PictureInfo(TypedDict):
    width: int
    height: int
    channels: int
    format: str
    bit_depth: int
    float: bool
    orientation: int
    grey: bool
    cmyk: bool
    color: str
    warnings: list[str]

class CountedInfo(PictureInfo):
    counts: dict[str, int]

class ReadInfo(CountedInfo):
    usable: NDArray[np.bool_]

class PhotoInfo(CountedInfo):
    isolated: float

def probe(path: FilePath, *, as_linear: bool = True) -> PictureInfo: ...
def read(
    path: FilePath, *, as_linear: bool = True
) -> tuple[NDArray[np.float32], NDArray[np.float32] | None, ReadInfo]: ...
def read_at_size(
    path: FilePath,
    width: int,
    height: int,
    *,
    masks: Sequence[tuple[FilePath, str]] = (),
    response: Response | None = None,
    counted: Sequence[float] | None = None,
    corners: ArrayLike | None = None,
    within: NDArray[np.bool_] | None = None,
) -> tuple[
    NDArray[np.float32], NDArray[np.float32], NDArray[np.float32], PhotoInfo, list[CountedInfo]
]: ...
def resize(pixels: NDArray[np.float32], width: int, height: int) -> NDArray[np.float32]: ...
def write_exr(
    path: FilePath, pixels: NDArray[np.float32], channel_names: Sequence[str] | None = None
) -> None: ...
def write_png(path: FilePath, pixels: NDArray[np.float32], bit_depth: int = 8) -> None: ...
def srgb_encode(x: NDArray[np.float32]) -> NDArray[np.float32]: ...
def srgb_decode(x: NDArray[np.float32]) -> NDArray[np.float32]: ...
