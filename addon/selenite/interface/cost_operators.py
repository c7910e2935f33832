# SPDX-License-Identifier: GPL-3.0-or-later
"""How long each preset will take on this scene: one short fit, timed."""

from __future__ import annotations

from dataclasses import replace

import bpy

from ..fit_run import cost
from ..fit_run.job import FitFailed
from ..fit_run.plan import FitPlan, prepare
from ..fit_run.settings import PRESETS, FitSettings
from ..native import NativeUnavailable
from ..problems import BadInput, Problem
from ..scene_read.photos import packed_photos
from ..scene_read.scene import read_scene
from .request import run_request
from .row_operators import report_problems
from .state import CHECK, RUN, SECONDS, TRADE


class SELENITE_OT_estimate(bpy.types.Operator):
    """Fit two iterations, and tell from them how long each preset will take"""

    bl_idname = "selenite.estimate"
    bl_label = "Estimate Time"

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Nothing runs that would slow it down."""
        cls.poll_message_set("A fit or a check is running")
        return RUN.job is None and CHECK.job is None and TRADE.trade is None

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Waits for the short fit; nothing of it is kept but its time."""
        problems: list[Problem] = []
        try:
            values = read_scene(context.scene, context.evaluated_depsgraph_get())
            wanted = replace(run_request(context.scene, values, problems), stages=())
            if problems:
                raise BadInput([*values.problems, *problems])
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


CLASSES = (SELENITE_OT_estimate,)
