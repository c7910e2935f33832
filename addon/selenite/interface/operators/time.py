# SPDX-License-Identifier: GPL-3.0-or-later
"""Seconds and errors of fits of the open scene: expected, or measured by `selenite trade`."""

from __future__ import annotations

import bpy

from ...fit_run.answer.results import new_folder
from ...fit_run.job import FitFailed
from ...problems import BadInput
from ...scene_read.geometry.bodies import judge_bodies
from ...scene_read.photos import packed_photos
from ...scene_read.reading.render_depsgraph import Reading
from ...scene_read.scene import read_scene, reading
from ...trade import report
from ...trade.expected import Estimate
from ...trade.measure import Trade
from ...trade.start import estimate_of, trade_of
from ..output_folder import output_folder
from ..request import run_request
from ..state import ESTIMATE, EXPECTED, TRADE
from ..texts import announce
from ..ticking import CancelsWork, Ticking, WorksInThread, built, redraw


class SELENITE_OT_estimate(WorksInThread):
    """Time two iterations and compute the Fisher information of the photos: how long each preset
    will take, and how far off the ticked parameters will be. Valid near the values that the fit
    starts from: where they are far from the right ones, apply the fit and estimate again. Esc
    cancels"""

    bl_idname = "selenite.estimate"
    bl_label = "Estimate Time and Error"
    background = ESTIMATE
    failure = "Nothing is estimated"

    def _asking(self, context: bpy.types.Context) -> Reading[Estimate]:
        scene = context.scene
        values = yield from reading(scene)
        values.bodies = judge_bodies(values)
        estimate = estimate_of(values, run_request(scene, values), packed_photos())
        EXPECTED.pop(scene.name, None)
        return estimate

    def _end(self, work: Estimate | None) -> set[str]:
        if work is None:
            return {"CANCELLED"}
        EXPECTED[ESTIMATE.scene_name] = work.lines()
        return {"FINISHED"}


class SELENITE_OT_cancel_estimate(CancelsWork):
    """Stop; nothing is estimated"""

    bl_idname = "selenite.cancel_estimate"
    bl_label = "Cancel"
    background = ESTIMATE


class SELENITE_OT_trade(Ticking, bpy.types.Operator):
    """Render photos of the scene as it is, fit the ticked parameters to them with many settings,
    and write what each takes and how far it is off"""

    bl_idname = "selenite.trade"
    bl_label = "Measure Time against Error"

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Goes on at each tick of a timer."""
        if not self._start(context):
            return {"CANCELLED"}
        return self._add_timer(context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Without a window: runs to the end of the budget."""
        if not self._start(context):
            return {"CANCELLED"}
        try:
            for step in TRADE.steps:
                TRADE.step = step
        except (BadInput, FitFailed) as error:
            return self._failed(error)
        return self._finish(context)

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Everything but Esc passes through; Esc keeps what has been measured."""
        if TRADE.trade is None:  # stopped from elsewhere
            self._remove_timer(context)
            return {"CANCELLED"}
        if event.type == "ESC" and event.value == "PRESS":
            return self._finish(context)
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        try:
            TRADE.step = next(TRADE.steps, None)
        except (BadInput, FitFailed) as error:
            self._remove_timer(context)
            return self._failed(error)
        redraw(context)
        return {"PASS_THROUGH"} if TRADE.step is not None else self._finish(context)

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender quits or loads another file: the thread must end first."""
        TRADE.stop()
        self._remove_timer(context)

    def _start(self, context: bpy.types.Context) -> bool:
        trade = built(self, lambda: _trade(context))
        if trade is not None:
            TRADE.start(trade)
        return trade is not None

    def _finish(self, context: bpy.types.Context) -> set[str]:
        self._remove_timer(context)
        trade = TRADE.trade
        TRADE.stop()
        TRADE.lines = _lines(trade)
        parent = output_folder(context.scene)
        try:
            folder = new_folder(parent, "-trade")
            content = report.report(trade)
            report.write(content, folder)
        except OSError as error:
            announce(self, {"ERROR"}, f"Cannot write to '{parent}': {error}; choose another folder")
            return {"CANCELLED"}
        if why := report.why_no_plot(content):
            announce(self, {"WARNING"}, f"{why}; the table is there")
        announce(self, {"INFO"}, f"Wrote {folder}")
        redraw(context)
        return {"FINISHED"}

    def _failed(self, error: BadInput | FitFailed) -> set[str]:
        TRADE.stop()
        announce(self, {"ERROR"}, str(error))
        return {"CANCELLED"}


def _trade(context: bpy.types.Context) -> Trade:
    """Of the ticked parameters. Raises BadInput and NativeUnavailable."""
    scene = context.scene
    values = read_scene(scene)
    wanted = run_request(scene, values)
    return trade_of(values, wanted, packed_photos(), scene.selenite.trade_budget)


def _lines(trade: Trade) -> list[str]:
    """What the panel shows: the presets."""
    return [
        f"{row.choice.name.capitalize()}: {row.mean('seconds'):.0f} s, error {row.error():.3g}"
        if row.runs
        else f"{row.choice.name.capitalize()}: not run, about {row.expected_seconds:.0f} s"
        for row in trade.rows
        if row.choice.preset
    ]


CLASSES = (SELENITE_OT_estimate, SELENITE_OT_cancel_estimate, SELENITE_OT_trade)
