# SPDX-License-Identifier: GPL-3.0-or-later
"""Time against error on the open scene: `selenite trade` from the panel."""

from __future__ import annotations

from pathlib import Path

import bpy

from ..fit_run.job import FitFailed
from ..fit_run.results import new_folder
from ..native import NativeUnavailable
from ..problems import BadInput, Problem
from ..scene_read.photos import packed_photos
from ..scene_read.scene import read_scene
from ..trade import report
from ..trade.measure import Trade
from ..trade.start import trade_of
from .fit_operators import redraw
from .request import run_request
from .row_operators import report_problems
from .state import CHECK, RUN, TRADE

_TICK = 0.2  # seconds between two looks


class SELENITE_OT_trade(bpy.types.Operator):
    """Render photos of the scene as it is, fit the ticked parameters to them with many settings,
    and write what each takes and how far it is off"""

    bl_idname = "selenite.trade"
    bl_label = "Measure Time against Error"

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Nothing runs that would slow it down."""
        cls.poll_message_set("A fit or a check is running")
        return RUN.job is None and CHECK.job is None and TRADE.trade is None

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Goes on at each tick of a timer."""
        if not self._start(context):
            return {"CANCELLED"}
        manager = context.window_manager
        self._timer = manager.event_timer_add(_TICK, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

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
        scene, problems = context.scene, list[Problem]()
        try:
            values = read_scene(scene, context.evaluated_depsgraph_get())
            wanted = run_request(scene, values, problems)
            if problems:
                raise BadInput([*values.problems, *problems])
            trade = trade_of(values, wanted, packed_photos(), scene.selenite.trade_budget)
        except BadInput as error:
            report_problems(self, error)
            return False
        except NativeUnavailable as error:
            self.report({"ERROR"}, str(error))
            return False
        TRADE.start(trade)
        return True

    def _finish(self, context: bpy.types.Context) -> set[str]:
        self._remove_timer(context)
        trade = TRADE.trade
        TRADE.stop()
        parent = Path(bpy.path.abspath(context.scene.selenite.output))
        try:
            folder = new_folder(parent, "-trade")
            files = report.write(report.report(trade), folder)
        except OSError as error:
            self.report({"ERROR"}, f"Cannot write to '{parent}': {error}; choose another folder")
            return {"CANCELLED"}
        TRADE.lines = _lines(trade)
        if files["plot"] is None:
            self.report({"WARNING"}, f"{report.NO_PLOT}; the table is there")
        self.report({"INFO"}, f"Wrote {folder}")
        redraw(context)
        return {"FINISHED"}

    def _failed(self, error: BadInput | FitFailed) -> set[str]:
        TRADE.stop()
        self.report({"ERROR"}, str(error))
        return {"CANCELLED"}

    def _remove_timer(self, context: bpy.types.Context) -> None:
        timer = getattr(self, "_timer", None)
        if timer is not None:
            context.window_manager.event_timer_remove(timer)
            self._timer = None


def _lines(trade: Trade) -> list[str]:
    """What the panel shows: the presets."""
    return [
        f"{row.choice.name.capitalize()}: {row.mean('seconds'):.0f} s, error {row.error():.3g}"
        if row.runs
        else f"{row.choice.name.capitalize()}: not run, about {row.expected_seconds:.0f} s"
        for row in trade.rows
        if row.choice.preset
    ]


CLASSES = (SELENITE_OT_trade,)
