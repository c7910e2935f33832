# SPDX-License-Identifier: GPL-3.0-or-later
"""The file that a grid or an image starts from, and what is wrong with the choice of a start."""

from __future__ import annotations

import bpy

from ...problems import BadInput, Problem


def chosen_file(
    row: bpy.types.PropertyGroup, words: tuple[str, str], title: str, *, has_own: bool
) -> str:
    """Absolute; "" of a row that starts from no file. words: what the field and its file are
    called; title: of a problem; has_own: the scene has one. Raises BadInput."""
    thing, file = words
    if row.grid_from == "file":
        if not row.grid_path:
            cure = f"choose a {file}, or another start"
            raise BadInput(Problem(title, "it starts from a file, and none is chosen", cure))
        return str(bpy.path.abspath(row.grid_path))
    if row.grid_from == "scene" and not has_own:
        cause = f"it starts from the scene's {thing}, and there is none"
        raise BadInput(Problem(title, cause, "choose New or File"))
    return ""
