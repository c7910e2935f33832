# SPDX-License-Identifier: GPL-3.0-or-later
"""A fit for each material with ticked parameters, by `selenite batch` in another process."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import cast

import bpy

from ...capture.captures_file import write_captures_file
from ...capture.request import with_ids
from ...capture.scene_captures import captures_of
from ...messages import message
from ...parameters import join_name
from ...paths import file_stems
from ...problems import BadInput, Problem, listed
from ...report.batch_page import PAGE, Ended
from ...report.results import new_folder
from ...scene_read.blend_file import write_blend_copy
from ...scene_read.blender_process import BlenderProcess
from ...scene_read.camera import named_cameras
from ..output_folder import output_folder
from ..progress.notice import scroll_up
from ..request import fit_settings
from ..rows.fields import is_field, is_image
from ..running.command import RunsCommand, command_job
from ..state import BATCH
from ..texts import announce, paragraph

#: Of the folder with the results of all objects.
SUFFIX = ".objects"
_FILE, _SCENE, _CAPTURES = "objects.toml", "scene.blend", "captures.json"
#: Pixels that are taken off the rim of each object, where its captures do not say.
_RIM = 1


class SELENITE_OT_fit_objects(RunsCommand):
    """Fit each material with ticked parameters by itself, one after the other, to what the cameras
    see of its objects. The results are a page and a scene for each. Esc stops and keeps those that
    have ended"""

    bl_idname = "selenite.fit_objects"
    bl_label = "Fit All Captured Objects"

    command = BATCH
    failure = "The objects are not fitted"

    def _job(self, context: bpy.types.Context) -> tuple[BlenderProcess, Sequence[str]]:
        scene = context.scene
        text = _toml(scene, list(_tables(scene)))
        job = command_job("selenite-objects-")
        folder = new_folder(output_folder(scene), SUFFIX)
        folder.mkdir(parents=True)
        # Not the process's own copy: results refer to this one, and its paths fit this place.
        write_blend_copy(str(folder / _SCENE), "choose another folder")
        captures = with_ids(captures_of(scene), named_cameras(scene))
        write_captures_file(folder / _CAPTURES, captures)
        (folder / _FILE).write_text(text, encoding="utf-8")
        scroll_up()
        return job, ["batch", str(folder / _FILE), f"--out={folder}"]

    def _end(self, _scene: bpy.types.Scene, report: Mapping[str, object]) -> set[str]:
        rows = cast("Sequence[Mapping[str, object]]", report["fits"])
        fits, folder = [Ended.of_json(row) for row in rows], Path(str(report["folder"]))
        left = [fit.name for fit in fits if fit.status != "done"]
        text = message(
            "batch.objects-are-done",
            "{done} of {all} objects are fitted: {folder}",
            done=len(fits) - len(left),
            all=len(fits),
            folder=folder,
        )
        BATCH.lines = [text]
        if left:
            BATCH.lines.append(
                message("batch.without-result", "Without a result: {names}", names=listed(left))
            )
        announce(self, {"WARNING" if left else "INFO"}, text)
        if not bpy.app.background:
            bpy.ops.wm.url_open(url=(folder / PAGE).as_uri())
        return {"FINISHED"}


def draw(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """The button, and what was found; progress is in the head."""
    layout.operator("selenite.fit_objects", icon="OUTLINER_OB_GROUP_INSTANCE")
    for line in BATCH.lines:
        paragraph(layout, context, line)


def _tables(scene: bpy.types.Scene) -> Iterator[dict[str, object]]:
    """A fit for each material with ticked parameters. Raises BadInput."""
    rows = [row for row in scene.selenite.rows if row.enabled and row.kind == "material"]
    if not rows:
        cure = "tick parameters of each object's material"
        title = SELENITE_OT_fit_objects.bl_label
        raise BadInput(Problem(title, "no parameter of a material is ticked", cure))
    owners = list(dict.fromkeys(row.owner for row in rows))
    stems = file_stems(owners)
    for owner in owners:
        yield _table(stems[owner], owner, [row for row in rows if row.owner == owner])


def _table(stem: str, owner: str, rows: Sequence[bpy.types.PropertyGroup]) -> dict[str, object]:
    """What the rows ask for, as options of `selenite fit`."""
    quoted = json.dumps(owner, ensure_ascii=False)
    constants = [row for row in rows if not is_field(row)]
    grids = {
        join_name(quoted, row.parameter): row.texels if is_image(row) else row.voxels
        for row in rows
        if is_field(row) and row.grid_from == "new"
    }
    table: dict[str, object] = {
        "name": stem,
        "fit": f"{quoted}:{','.join(row.parameter for row in rows)}",
        "save": f"{stem}.blend",
        "bounds": {
            join_name(quoted, row.parameter): [row.minimum, row.maximum] for row in constants
        },
    }
    if own := [row for row in constants if row.use_start]:
        table["start"] = {
            join_name(quoted, row.parameter): list(row.start[: row.width]) for row in own
        }
    if grids:
        table["grid"] = grids
    return table


def _toml(scene: bpy.types.Scene, tables: Sequence[Mapping[str, object]]) -> str:
    """The file of the batch. Raises BadInput."""
    stages = scene.selenite.stage_mode
    if stages == "own":
        cause, cure = "an own list names the parameters of one fit", "choose other Stages"
        raise BadInput(Problem("Stages", cause, cure))
    shared = {"scene": _SCENE, "captures": _CAPTURES, "silhouette": _RIM, "stages": stages}
    parts = ["[defaults]", *_pairs({**shared, **asdict(fit_settings(scene))})]
    for table in tables:
        parts += ["", "[[fit]]", *_pairs(table)]
    return "\n".join(parts) + "\n"


def _pairs(table: Mapping[str, object]) -> Iterator[str]:
    for key, value in table.items():
        yield f"{key} = {_value(value)}"


def _value(value: object) -> str:
    """Strings, numbers and lists are as in JSON."""
    if isinstance(value, Mapping):
        inner = (f"{_value(str(key))} = {_value(item)}" for key, item in value.items())
        return f"{{ {', '.join(inner)} }}"
    return json.dumps(value, ensure_ascii=False)


CLASSES = (SELENITE_OT_fit_objects,)
