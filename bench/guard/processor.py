# SPDX-License-Identifier: GPL-3.0-or-later
"""The kind of this processor: results of the same kind are compared."""

from __future__ import annotations

import os
import platform
from pathlib import Path

_VENDORS = {"AuthenticAMD": "AMD", "GenuineIntel": "Intel"}
_SETS = ("avx512f", "avx2")


def kind(cpuinfo: str | None = None) -> str:
    """Maker, family and widest instruction set: "AMD 25 avx512f". With SELENITE_AVX2=0 it ends in
    "without avx2". cpuinfo: the text of /proc/cpuinfo, read where None."""
    if cpuinfo is None:
        path = Path("/proc/cpuinfo")
        cpuinfo = path.read_text(encoding="utf-8") if path.is_file() else ""
    first: dict[str, str] = {}
    for line in cpuinfo.splitlines():
        name, _, value = line.partition(":")
        first.setdefault(name.strip(), value.strip())
    if "vendor_id" not in first:
        return f"{platform.machine() or 'unknown'}"
    vendor = _VENDORS.get(first["vendor_id"], first["vendor_id"])
    flags = first.get("flags", "").split()
    widest = next((name for name in _SETS if name in flags), "sse")
    if os.environ.get("SELENITE_AVX2") == "0":
        widest = "without avx2"
    return f"{vendor} {first.get('cpu family', '?')} {widest}"
