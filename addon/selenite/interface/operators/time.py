# SPDX-License-Identifier: GPL-3.0-or-later
"""Seconds and errors of fits of the open scene: expected, or measured by `selenite trade`."""

from __future__ import annotations

import bpy

from ...advice.trade.expected import Estimate
from ...advice.trade.measure import Trade
from ...advice.trade.start import estimate_of
from ...capture.scene_captures import packed_photos
from ...messages import message
from ...scene_read.geometry.bodies import judge_bodies
from ...scene_read.reading.render_depsgraph import Reading
from ...scene_read.scene import reading
from ..output_folder import output_folder
from ..progress.background import draw_work
from ..request import run_request
from ..running.measuring import Measuring
from ..running.run import CANCELLED
from ..state import ESTIMATE, EXPECTED, TRADE
from ..texts import announce, paragraph
from ..ticking import WorksInThread


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


class SELENITE_OT_trade(WorksInThread):
    """Render photos of the scene as it is, fit the ticked parameters to them with many settings,
    and write what each takes and how far it is off. Esc keeps what has been measured"""

    bl_idname = "selenite.trade"
    bl_label = "Measure Time against Error"
    background = TRADE
    failure = "Nothing is measured"

    def _asking(self, context: bpy.types.Context) -> Reading[Measuring]:
        scene = context.scene
        values = yield from reading(scene)
        wanted = run_request(scene, values)
        budget, folder = scene.selenite.trade_budget, output_folder(scene)
        return Measuring(values, wanted, packed_photos(), budget, folder)

    def _end(self, work: Measuring | None) -> set[str]:
        if work is None or work.trade is None:
            TRADE.lines = [CANCELLED]
            return {"CANCELLED"}
        TRADE.lines = _lines(work.trade)
        if work.trouble:
            announce(self, {"ERROR"}, work.trouble)
            return {"CANCELLED"}
        if work.remark:
            announce(
                self,
                {"WARNING"},
                message("time.table-there", "{remark}; the table is there", remark=work.remark),
            )
        announce(self, {"INFO"}, f"Wrote {work.folder}")
        return {"FINISHED"}


def draw_trade(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """The button, how far it has come, and what was found."""
    if not draw_work(layout, TRADE, keeps=True):
        layout.operator("selenite.trade", icon="GRAPH")
    for line in TRADE.lines:
        paragraph(layout, context, line)


def _lines(trade: Trade) -> list[str]:
    """What the panel shows: the presets."""
    return [
        message(
            "time.error",
            "{preset}: {seconds} s, error {error}",
            preset=row.choice.name.capitalize(),
            seconds=f"{row.mean('seconds'):.0f}",
            error=f"{row.error():.3g}",
        )
        if row.runs
        else message(
            "time.not-run-about",
            "{preset}: not run, about {seconds} s",
            preset=row.choice.name.capitalize(),
            seconds=f"{row.expected_seconds:.0f}",
        )
        for row in trade.rows
        if row.choice.preset
    ]


CLASSES = (
    SELENITE_OT_estimate,
    SELENITE_OT_trade,
)
