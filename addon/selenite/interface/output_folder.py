# SPDX-License-Identifier: GPL-3.0-or-later
"""Where results go: beside a saved file, else into the user's own folder."""

from __future__ import annotations

from pathlib import Path

import bpy

from ..paths import user_folder
from .furniture.preferences import preferences

#: The property's default: unless the user has changed it, the preferences may name another folder.
DEFAULT_FOLDER = "//selenite-fits"


def output_folder(scene: bpy.types.Scene) -> Path:
    """Absolute. The panel's folder; where that is beside a file that was never saved, the folder of
    the preferences, or else the user's documents."""
    chosen = scene.selenite.output
    own = preferences().output
    if chosen == DEFAULT_FOLDER and own:
        return Path(bpy.path.abspath(own)).absolute()
    if chosen.startswith("//") and not bpy.data.filepath:
        return user_folder() / chosen.removeprefix("//")
    return Path(bpy.path.abspath(chosen)).absolute()
