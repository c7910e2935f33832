# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender ends, or the add-on is switched off, while work of ours goes on in a thread."""

import subprocess
import sys
import threading
from pathlib import Path

import bpy
import made_scenes as made
import pytest
from test_interface import prepare_fit

import selenite
from selenite.advice.information.job import BackgroundJob, Step
from selenite.capture import prepared
from selenite.fit import plan
from selenite.fit.checkpoint import Unfinished
from selenite.interface import state
from selenite.interface.request import run_request
from selenite.interface.running.run import PreparingPhase
from selenite.interface.running.work import Preparing

pytestmark = [pytest.mark.blender, pytest.mark.blender34]

ADDON = Path(selenite.__file__).resolve().parents[1]
_ENDED_MEANWHILE = """
import sys, time
sys.path.insert(0, {addon!r})
sys.path += {packages!r}
import bpy, selenite
selenite.register()
from selenite.advice.information.job import BackgroundJob, Step
from selenite.interface import state

class Slow:
    def steps(self):
        time.sleep(1.0)
        yield Step(1.0, "")
        print("the thread has ended", flush=True)
    def cancel(self):
        pass

job = BackgroundJob(Slow())
job.start()
state.RUN.left.append(job)
"""


@pytest.mark.parametrize("switched_off", [False, True])
def test_a_process_ends_after_its_threads(tmp_path, switched_off):
    """A thread that comes back from native code while Python ends aborts the process."""
    script = tmp_path / "ended.py"
    packages = [item for item in sys.path if item.endswith("-packages")]
    text = _ENDED_MEANWHILE.format(addon=str(ADDON), packages=packages)
    script.write_text(text + ("selenite.unregister()\n" if switched_off else ""))
    command = [sys.executable, str(script)]
    if bpy.app.binary_path:
        command = [bpy.app.binary_path, "-b", "--factory-startup", "--python", str(script)]
    done = subprocess.run(command, capture_output=True, timeout=120, check=False)
    assert b"the thread has ended" in done.stdout, (done.stdout + done.stderr).decode()
    assert done.returncode != -6


class _Waiting:
    """Work that goes on until it is allowed to end, whatever is asked."""

    def __init__(self):
        self.may_end = threading.Event()

    def steps(self):
        yield Step(0.0, "")
        self.may_end.wait(90.0)

    def cancel(self):
        """As the native build of a scene: not heard."""


def test_switching_off_waits_for_what_was_cancelled():
    selenite.register()
    work = _Waiting()
    job = BackgroundJob(work)
    state.RUN.begin(PreparingPhase(job, "Scene"))
    state.RUN.ask_to_stop(keep=False)
    assert not state.RUN.is_active and job.progress()[0]
    threading.Timer(0.5, work.may_end.set).start()
    selenite.unregister()
    assert not job.progress()[0] and not state.RUN.left


@pytest.mark.usefixtures("addon")
def test_another_file_opens_before_a_cancelled_preparation_has_ended():
    work = _Waiting()
    job = BackgroundJob(work)
    state.RUN.begin(PreparingPhase(job, "Scene"))
    state.RUN.stop()  # as the operator does that Blender ends
    assert job.progress()[0] and not state.RUN.is_active
    work.may_end.set()


@pytest.mark.usefixtures("addon")
def test_a_cancelled_preparation_ends_at_the_next_photo(tmp_path, monkeypatch):
    _, settings = prepare_fit(tmp_path)
    for name in ("Second", "Third"):
        made.camera(name)
        bpy.ops.selenite.add_capture()
        settings.captures[-1].camera = bpy.data.objects[name]
        settings.captures[-1].photo = settings.captures[0].photo
    values, scene = made.read(), bpy.context.scene
    work = Preparing(values, Unfinished(run_request(scene, values)), {}, "")
    seen, read = [], prepared._open

    def reading(*arguments):
        seen.append(1)
        work.cancel()
        return read(*arguments)

    monkeypatch.setattr(prepared, "_open", reading)
    monkeypatch.setattr(plan, "build_scene", lambda _: pytest.fail("a scene is built"))
    list(work.steps())
    assert len(seen) == 1 and work.job is None
