# SPDX-License-Identifier: GPL-3.0-or-later
"""A command of the command line on a copy of the file, in another process; and an operator that
waits for it."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import cast

import bpy

from ...fit.settings import PRESETS, FitSettings
from ...problems import BadInput
from ...scene_read.blender_process import BlenderProcess, ProcessFailed
from ..problem_reports import report_problems
from ..state import Command
from ..texts import announce, translated
from ..ticking import Ticking, built, redraw, show_status
from .run import CANCELLED

_MODULE = "selenite.commands.as_process"


def command_job(prefix: str) -> BlenderProcess:
    """With a copy of the scene as it is: see `scene_file`. prefix: of the folder's name. Raises
    BadInput."""
    return BlenderProcess(_MODULE, prefix)


def settings_words(settings: FitSettings, preset: str) -> list[str]:
    """Options of `selenite fit`: the preset, and what differs from it."""
    words, usual = [f"--preset={preset}"], asdict(PRESETS[preset])
    for name, value in asdict(settings).items():
        if value == usual[name]:
            continue
        option = f"--{name.replace('_', '-')}"
        if value is True:
            words.append(option)
        elif value is not False:
            words.append(f"{option}={value}")
        elif name in ("accumulate", "until_converged"):
            words.append(f"--no-{option.removeprefix('--')}")
    return words


class RunsCommand(Ticking, bpy.types.Operator):  # type: ignore[misc]
    """Base of an operator that runs a command. Esc stops it and keeps what it has found."""

    tick = 0.2  # the other process reports no more often

    command: Command
    #: How the report begins when the command failed.
    failure: str

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Starts the other process; a timer polls it."""
        return self._add_timer(context) if self._start(context) else {"CANCELLED"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Without a window: waits for the end."""
        return self._finish(context) if self._start(context) else {"CANCELLED"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Everything but Esc passes through, so that Blender stays usable."""
        if self.command.job is None:  # cancelled from elsewhere
            return self._over(context)
        if event.type == "ESC" and event.value == "PRESS":
            self.command.ask_to_stop()
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        step = self.command.update()
        show_status(context, step.text, step.fraction)
        return {"PASS_THROUGH"} if self.command.runs else self._finish(context)

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender quits or loads another file."""
        self.command.stop()
        self._remove_timer(context)

    @abstractmethod
    def _job(self, context: bpy.types.Context) -> tuple[BlenderProcess, Sequence[str]]:
        """The process, not started, and the words of its command. Raises BadInput."""

    @abstractmethod
    def _end(self, scene: bpy.types.Scene, report: Mapping[str, object]) -> set[str]:
        """Keeps what the command has reported. Returns what operators return."""

    def _start(self, context: bpy.types.Context) -> bool:
        found = built(self, lambda: self._job(context))
        if found is None:
            return False
        job, words = found
        job.ask({"words": list(words)})
        self.command.start(job, context.scene.name)
        redraw(context)
        return True

    def _over(self, context: bpy.types.Context) -> set[str]:
        self._remove_timer(context)
        show_status(context, None)
        redraw(context)
        return {"CANCELLED"}

    def _finish(self, context: bpy.types.Context) -> set[str]:
        job, self.command.job = self.command.job, None
        scene: bpy.types.Scene | None = bpy.data.scenes.get(self.command.scene_name)
        self._over(context)
        assert job is not None
        try:
            report = job.result().get("command")
            if report is None or not self.command.keeps or scene is None:
                self.command.lines = [CANCELLED]
                return {"CANCELLED"}
            return self._end(scene, cast("Mapping[str, object]", report))
        except BadInput as error:
            report_problems(self, error)
        except (ProcessFailed, OSError) as error:
            announce(self, {"ERROR"}, f"{translated(self.failure)}: {error}")
        finally:
            job.close()
        return {"CANCELLED"}
