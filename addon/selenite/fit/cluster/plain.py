# SPDX-License-Identifier: GPL-3.0-or-later
"""Plain values and arrays as bytes, without pickles: reading them runs no code."""

from __future__ import annotations

import json
from collections.abc import Mapping

import numpy as np

_MAGIC = b"selenite plain 1\n"
#: Kinds of numpy's types that are numbers.
_NUMBERS = "bfiu"


def packed(value: object) -> bytes:
    """None, booleans, numbers, texts, arrays of numbers, and lists and mappings of these."""
    arrays: list[bytes] = []
    text = json.dumps(_plain(value, arrays)).encode()
    return b"".join([_MAGIC, len(text).to_bytes(8, "little"), text, *arrays])


def unpacked(data: bytes) -> object:
    """The inverse; tuples come back as lists. Raises ValueError."""
    start = len(_MAGIC) + 8
    if data[: len(_MAGIC)] != _MAGIC or len(data) < start:
        raise ValueError("these are no plain values")
    end = start + int.from_bytes(data[len(_MAGIC) : start], "little")
    try:
        return _value(json.loads(data[start:end]), memoryview(data)[end:])
    except (KeyError, TypeError, RecursionError) as error:
        raise ValueError(f"these plain values are damaged ({error!r})") from error


def _plain(value: object, arrays: list[bytes]) -> object:
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        if value.dtype.kind not in _NUMBERS:
            raise TypeError(f"an array of {value.dtype} is no plain value")
        start = sum(map(len, arrays))
        arrays.append(np.ascontiguousarray(value).tobytes())
        return {"array": [value.dtype.str, list(value.shape), start]}
    if isinstance(value, Mapping):
        pairs = [[_plain(key, arrays), _plain(item, arrays)] for key, item in value.items()]
        return {"pairs": pairs}
    if isinstance(value, (list, tuple)):
        return [_plain(item, arrays) for item in value]
    if isinstance(value, (set, frozenset)):
        return [_plain(item, arrays) for item in sorted(value)]
    raise TypeError(f"{type(value).__name__} is no plain value")


def _value(plain: object, arrays: memoryview) -> object:
    if isinstance(plain, list):
        return [_value(item, arrays) for item in plain]
    if not isinstance(plain, dict):
        return plain
    if "pairs" in plain:
        return {_value(key, arrays): _value(item, arrays) for key, item in plain["pairs"]}
    name, shape, start = plain["array"]
    dtype = np.dtype(name)
    if dtype.kind not in _NUMBERS or start < 0 or any(size < 0 for size in shape):
        raise ValueError(f"an array of {name} is no plain value")
    count = int(np.prod(shape, dtype=np.int64))
    return (
        np.frombuffer(arrays, dtype, count, start).reshape(shape)
        if count
        else np.zeros(shape, dtype)
    )
