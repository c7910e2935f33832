# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles settings under which a render is an unbiased estimate of what the materials say.

The table itself is the add-on's (`selenite.cycles_check.render_settings`); this finds it from a
scene script that runs in a Blender where the add-on is not installed.
"""

import sys
from pathlib import Path

ADDON = Path(__file__).resolve().parents[1] / "addon"
if str(ADDON) not in sys.path:
    sys.path.insert(0, str(ADDON))

from selenite.cycles_check.render_settings import set_comparison  # noqa: E402

__all__ = ["set_comparison"]
