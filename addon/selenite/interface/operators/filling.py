# SPDX-License-Identifier: GPL-3.0-or-later
"""The list of parameters, read from the scene, and the usual ticks."""

from __future__ import annotations

import bpy

from ...advice.information.job import BackgroundJob
from ...cycles_check.render_settings import contents_of
from ...fit.unknowns import USUAL
from ...problems import Problem
from ...scene_read.scene import read_scene
from ...scene_read.values import SceneValues
from ..request import refresh_rows
from ..rows.owners import owns
from ..running.work import Survey
from ..state import CHECK, RUN, remember
from ..ticking import redraw

_POLL = 0.1  # seconds
_USUAL = {"material": USUAL, "object": (), "light": ("power",), "world": ("strength",)}


def list_parameters(scene: bpy.types.Scene) -> list[Problem]:
    """Reads the scene at once and fills the list; returns what stands in the way of a render.
    Raises NativeUnavailable."""
    return fill(scene, read_scene(scene, surveys=bpy.app.background, bakes=False))


def fill(scene: bpy.types.Scene, values: SceneValues) -> list[Problem]:
    """As `list_parameters`, with what was read, without a survey if there is a window."""
    refresh_rows(scene, values)
    remember(scene.name, values)
    if not bpy.app.background:
        _survey_soon(scene.name, values)
    CHECK.contents[scene.name] = contents_of(scene)
    return list(values.problems)


def _survey_soon(scene_name: str, values: SceneValues) -> None:
    """Whether bodies are closed, from a thread: what it finds appears in the panel later."""
    job = BackgroundJob(Survey(values))
    RUN.left.append(job)
    job.start()

    def poll() -> float | None:
        if job.progress()[0]:
            return _POLL
        if job in RUN.left:
            RUN.left.remove(job)
        remember(scene_name, values)
        redraw(bpy.context)
        return None

    bpy.app.timers.register(poll, first_interval=_POLL)


def tick_usual_of_first(settings: bpy.types.PropertyGroup) -> None:
    """The usual ticks of the active group, in a list that is new."""
    if len(settings.owners):
        tick_usual(settings, settings.owners[settings.active_owner])


def tick_usual(settings: bpy.types.PropertyGroup, owner: bpy.types.PropertyGroup) -> int:
    """Ticks what is usually unknown of an owner and not locked; returns how many."""
    found = [
        row
        for row in settings.rows
        if owns(owner, row) and (row.usual or row.parameter in _USUAL[row.kind]) and not row.reason
    ]
    for row in found:
        row.enabled = True
    return len(found)
