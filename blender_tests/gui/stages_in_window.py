# SPDX-License-Identifier: GPL-3.0-or-later
"""An own list of stages in the panel, its run, a remark below it, and a run that goes on."""

import bpy
from _driving import (
    ENDLESS,
    FOLDER,
    in_window,
    made,
    photographed,
    picture,
    press_escape,
    run,
    running,
)

from selenite.interface import panels, state


def prepare():
    """A sphere, a photo darker than its bounds allow, two stages."""
    made.studio()
    settings = photographed(0.1)
    settings.height, settings.tolerance, settings.output = 24, 0.0, str(FOLDER / "fits")
    settings.loss = "mae"  # what is no sum of squares does not converge
    rows = {row.parameter: row for row in settings.rows}
    rows["base_color"].minimum = 0.5
    settings.stage_mode = "own"
    for name, iterations in (("base_color", 12), ("roughness", ENDLESS)):
        rows[name].enabled = True
        in_window(bpy.ops.selenite.add_stage)
        settings.stages[-1].iterations = iterations
    return settings


def second_stage():
    """The first stage has ended, and a tick has seen remarks on the second one."""
    fitting = state.RUN.fitting
    progress = fitting.progress if fitting is not None else None
    return progress is not None and progress.stage == 1 and bool(fitting.job.newest_notes)


def steps():
    """See `_driving.run`."""
    settings = prepare()
    yield 0.5
    picture("own list")
    in_window(bpy.ops.selenite.start, "INVOKE_DEFAULT")
    yield second_stage
    yield 2.5  # the state goes to disk
    picture("second stage")
    folder = state.RUN.fitting.recorder.folder
    assert (folder / "state.json").is_file()
    state.RUN.fitting.recorder = None  # as if Blender had ended here
    press_escape()
    yield lambda: not state.RUN.is_active
    assert [stage.iterations > 0 for stage in state.RUN.done.result.fit.stages] == [True, True]
    yield 0.5
    picture("remarks")

    in_window(bpy.ops.selenite.resume, "EXEC_DEFAULT", directory=str(folder))
    yield lambda: running() or not state.RUN.is_active
    assert state.RUN.is_active, state.PROBLEMS
    assert state.RUN.fitting.progress.stage == 1, "the first stage is not fitted again"
    press_escape()
    yield lambda: not state.RUN.is_active
    assert len(settings.results) == 2
    yield lambda: not folder.exists()  # its record is closed by a thread


run(steps, panels, {panels.SELENITE_PT_fit, panels.SELENITE_PT_result})
