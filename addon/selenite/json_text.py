# SPDX-License-Identifier: GPL-3.0-or-later
"""JSON that every reader takes, and files of it that may hold anything."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Mapping
from pathlib import Path

from .paths import why_not_file

_SURROGATE = re.compile("[\ud800-\udfff]")
#: Bytes of a file that a person may have written.
LARGEST = 64 << 20


def json_text(data: Mapping[str, object], indent: int | None = None) -> str:
    """One object. A number that is not finite becomes null, as JSON has none; a byte of a file's
    name that is not UTF-8 becomes an escape, which Python reads back."""
    text = json.dumps(_finite(data), indent=indent, ensure_ascii=False, allow_nan=False)
    return _SURROGATE.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


def read_json(path: Path, largest: int = LARGEST) -> object:
    """What a file holds. Raises ValueError, whose text says why it can't be read."""
    if why := why_not_file(path):
        raise ValueError(why)
    try:
        with path.open("rb") as file:
            # The size comes first: read(largest) would reserve as much for a file of any size.
            if os.fstat(file.fileno()).st_size > largest:
                raise ValueError(f"it has more than {largest >> 20} MiB")
            found: object = json.loads(file.read().decode("utf-8-sig"))
            return found
    except OSError as error:
        raise ValueError((error.strerror or str(error)).lower()) from error
    except RecursionError as error:
        raise ValueError("its lists are nested too deeply") from error
    except json.JSONDecodeError as error:
        raise ValueError(f"it is not JSON: {error}") from error
    except UnicodeDecodeError as error:
        raise ValueError(f"it is not text in UTF-8: {error.reason}") from error


def _finite(value: object) -> object:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(item) for item in value]
    return value
