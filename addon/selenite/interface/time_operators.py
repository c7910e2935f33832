# SPDX-License-Identifier: GPL-3.0-or-later
"""What fits of the open scene take: seconds of each preset, and `selenite trade` from the panel."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import bpy

from ..fit_run import cost
from ..fit_run.job import FitFailed
from ..fit_run.plan import FitPlan, prepare
from ..fit_run.results import new_folder
from ..fit_run.settings import PRESETS, FitSettings
from ..native import NativeUnavailable
from ..problems import BadInput
from ..scene_read.photos import packed_photos
from ..scene_read.scene import read_scene
from ..trade import report
from ..trade.measure import Trade
from ..trade.start import trade_of
from .request import run_request
from .row_operators import report_problems
from .state import SECONDS, TRADE, is_idle
from .ticking import Ticking, redraw


class SELENITE_OT_estimate(bpy.types.Operator):
    """Fit two iterations, and tell from them how long each preset will take"""

    bl_idname = "selenite.estimate"
    bl_label = "Estimate Time"

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Nothing runs that would slow it down."""
        cls.poll_message_set("A fit or a check is running")
        return is_idle()

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Waits for the short fit; nothing of it is kept but its time."""
        try:
            values = read_scene(context.scene, context.evaluated_depsgraph_get())
            wanted = replace(run_request(context.scene, values), stages=())
            packed = packed_photos()

            def plan_of(settings: FitSettings) -> FitPlan:
                return prepare(values, replace(wanted, settings=settings), packed)

            plan = plan_of(wanted.settings)
            per_path = cost.seconds_per_path(plan_of, wanted.settings)
        except BadInput as error:
            report_problems(self, error)
            return {"CANCELLED"}
        except (NativeUnavailable, FitFailed) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        SECONDS[context.scene.name] = {
            name: cost.expected(plan, preset, per_path) for name, preset in PRESETS.items()
        }
        return {"FINISHED"}


def seconds_text(seconds: float) -> str:
    """As the panel shows it; the estimate is good to about a third."""
    return f"about {seconds:.0f} s" if seconds < 100 else f"about {seconds / 60:.0f} min"


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
        scene = context.scene
        try:
            values = read_scene(scene, context.evaluated_depsgraph_get())
            wanted = run_request(scene, values)
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


def _lines(trade: Trade) -> list[str]:
    """What the panel shows: the presets."""
    return [
        f"{row.choice.name.capitalize()}: {row.mean('seconds'):.0f} s, error {row.error():.3g}"
        if row.runs
        else f"{row.choice.name.capitalize()}: not run, about {row.expected_seconds:.0f} s"
        for row in trade.rows
        if row.choice.preset
    ]


CLASSES = (SELENITE_OT_estimate, SELENITE_OT_trade)
