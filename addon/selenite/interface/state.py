# SPDX-License-Identifier: GPL-3.0-or-later
"""The running fit and check. Kept in Python, not in the .blend, and without pointers into it."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from .. import native
from ..advice.information.job import BackgroundJob, Work
from ..advice.information.job import Step as BackgroundStep
from ..cycles_check.job import CheckJob
from ..cycles_check.render_settings import Contents
from ..fit.plan import FitPlan
from ..problems import Problem
from ..scene_read.blender_process import BlenderProcess, ProcessProgress
from ..scene_read.reading.job import ReadingJob
from ..scene_read.values import SceneValues
from .running.run import CANCELLED, Run

W = TypeVar("W", bound=Work)


@dataclass
class Warnings:
    """Of a scene as it was read, and of the photos and unknowns of the last fit."""

    of_scene: list[str] = field(default_factory=list)
    of_plan: list[str] = field(default_factory=list)


@dataclass
class Check:
    """At most one check in Cycles at a time. `lines` and `sheet` stay after its end.

    contents: scene name -> what was found in it when an operator last read it.
    """

    job: CheckJob | None = None
    scene_name: str = ""
    progress: ProcessProgress | None = None
    message: str = ""
    lines: list[str] = field(default_factory=list)
    sheet: Path | None = None
    contents: dict[str, Contents] = field(default_factory=dict)

    def start(self, job: CheckJob, scene_name: str) -> None:
        """Starts the other process."""
        self.job, self.scene_name, self.progress = job, scene_name, None
        self.forget()
        job.start()

    def forget(self) -> None:
        """What the last one has found is no longer about the result."""
        self.message, self.lines, self.sheet = "", [], None

    def cancel(self) -> None:
        """The other process ends at once; the scene was never touched."""
        if self.job is not None:
            self.stop()
            self.message = "Check cancelled"

    def stop(self) -> None:
        """Ends the other process and forgets the job."""
        if self.job is not None:
            self.job.close()
        self.job = None


@dataclass
class Background(Generic[W]):
    """At most one job of a kind at a time. `lines` stay after its end.

    hears: whether the thread ends soon where it is cancelled. Else nobody waits for it.
    """

    hears: bool = True

    job: BackgroundJob[W] | None = None
    scene_name: str = ""
    step: BackgroundStep | None = None
    lines: list[str] = field(default_factory=list)

    def start(self, job: BackgroundJob[W], scene_name: str) -> None:
        """Starts the thread."""
        self.job, self.scene_name, self.step, self.lines = job, scene_name, None, []
        job.start()

    def cancel(self) -> None:
        """Returns at once; the operator that waits for the thread sees that."""
        if self.job is None:
            return
        self.job.cancel()
        if not self.hears:
            RUN.left.append(self.job)
            self.job = None

    def stop(self) -> None:
        """Waits for the thread and forgets it."""
        job, self.job, self.step = self.job, None, None
        if job is not None:
            job.cancel()
            job.join()


# At run time without its parameter: typing remembers such a class for ever, and what this module
# holds of Blender with it, so that bpy would not end.
if TYPE_CHECKING:
    _OfWork = Background[Work]
else:
    _OfWork = Background


@dataclass
class Measurement(_OfWork):
    """At most one measurement of time against error at a time."""

    def cancel(self) -> None:
        """What has been measured is kept."""
        if self.job is not None:
            self.job.work.cancel()


@dataclass
class SceneReading:
    """At most one reading of the scene at a time that is no part of a fit."""

    job: ReadingJob[object] | None = None

    @property
    def is_cancelled(self) -> bool:
        """It goes on only because Blender's evaluation cannot be ended."""
        return self.job is not None and self.job.is_stopped

    def cancel(self) -> None:
        """It ends at the next object; the operator that waits for it sees that."""
        if self.job is not None:
            self.job.cancel()

    def stop(self) -> None:
        """Forgets it; nobody waits for it any more."""
        job, self.job = self.job, None
        if job is not None:
            job.abandon()


@dataclass
class Command:
    """At most one command of a kind at a time, in another process. `lines` stay after its end.

    has_children: it has started others, which it has to end itself.
    """

    has_children: bool = False

    job: BlenderProcess | None = None
    scene_name: str = ""
    step: BackgroundStep | None = None
    lines: list[str] = field(default_factory=list)
    keeps: bool = True
    runs: bool = False

    def start(self, job: BlenderProcess, scene_name: str) -> None:
        """Starts the process."""
        self.job, self.scene_name, self.step, self.lines = job, scene_name, None, []
        self.keeps = self.runs = True
        job.start()

    def update(self) -> BackgroundStep:
        """How far it has come."""
        assert self.job is not None
        progress = self.job.progress()
        self.runs = progress.running
        self.step = BackgroundStep(progress.fraction, progress.text)
        return self.step

    def ask_to_stop(self) -> None:
        """It ends soon and reports what it has."""
        if self.job is not None:
            self.job.ask_to_stop()

    def cancel(self) -> None:
        """It ends at once where it has no children, else soon; nothing is kept."""
        if self.job is None:
            return
        self.keeps = False
        if self.has_children:
            self.job.ask_to_stop()
            return
        self.stop()
        self.lines = [CANCELLED]

    def stop(self) -> None:
        """Ends the process, waits for it and forgets it."""
        job, self.job, self.step = self.job, None, None
        if job is not None and self.has_children:
            job.wind_up()
        elif job is not None:
            job.close()


RUN = Run()
READING = SceneReading()
CHECK = Check()
TRADE = Measurement()
NEXT: Background[Work] = Background()
ESTIMATE: Background[Work] = Background()
SAVE: Background[Work] = Background()
MASK: Background[Work] = Background(hears=False)
SPOTS: Background[Work] = Background(hears=False)
MODELS = Command()
BATCH = Command(has_children=True)
# Of modules that import this one
SAMPLE: Background[Any] = Background()
PAIRING: Background[Any] = Background(hears=False)
JOBS = (TRADE, NEXT, ESTIMATE, SAVE, MASK, SPOTS, SAMPLE, MODELS, BATCH)
#: Scene name -> what fits with the presets take, in lines, when it was last estimated.
EXPECTED: dict[str, list[str]] = {}
#: Scene name -> what is wrong with bodies that have to be closed, when an operator last read it.
SHAPES: dict[str, list[str]] = {}
#: Scene name -> what may be rendered otherwise, when an operator last read the scene and photos.
WARNINGS: dict[str, Warnings] = {}
#: Scene name -> what stands in the way of what was last asked for.
PROBLEMS: dict[str, list[Problem]] = {}


def forget() -> None:
    """Another file is open: what was said and found is about the one before, whose scenes may have
    the same names."""
    for kept in (PROBLEMS, EXPECTED, SHAPES, WARNINGS, CHECK.contents):
        kept.clear()
    CHECK.forget()
    PAIRING.cancel()
    for item in JOBS:
        item.lines = []
    if not RUN.is_active:
        RUN.last, RUN.message = None, ""


def end() -> None:
    """Ends all that runs and waits for every thread: one that comes back from native code while
    Python ends takes the whole process with it."""
    CHECK.stop()
    for item in (*JOBS, PAIRING, READING):
        item.stop()
    RUN.stop()
    while RUN.left:
        RUN.left.pop().wait()


def is_idle() -> bool:
    """Nothing runs: no fit, no reading, no check, no measurement, no other job."""
    return not RUN.is_active and all(item.job is None for item in (READING, CHECK, *JOBS))


def remember(scene_name: str, values: SceneValues) -> None:
    """What the panel says about the scene until an operator reads it again."""
    SHAPES[scene_name] = [body.fault for body in values.bodies if body.fault]
    WARNINGS.setdefault(scene_name, Warnings()).of_scene = list(values.warnings)


def remember_plan(scene_name: str, plan: FitPlan) -> None:
    """What the panel says about photos and unknowns until the next fit is prepared."""
    known = WARNINGS.setdefault(scene_name, Warnings())
    known.of_plan = [text for text in plan.warnings if text not in known.of_scene]


@lru_cache(maxsize=1)
def why_native_is_missing() -> str:
    """Empty if the native modules load. Asked once: a running Blender cannot replace them."""
    return native.why_unavailable()
