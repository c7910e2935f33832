# SPDX-License-Identifier: GPL-3.0-or-later
"""A fit by the workers of a cluster has the result of a fit by one process, byte by byte."""

import json
import math
import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager, suppress
from pathlib import Path

import made_scenes as made
import pytest
from command_line import command

pytestmark = pytest.mark.blender
distributed = pytest.importorskip("distributed")

from selenite.capture.request import CaptureRequest  # noqa: E402
from selenite.cli import main  # noqa: E402
from selenite.fit.cluster import workers as cluster_workers  # noqa: E402
from selenite.fit.cluster.address import Address  # noqa: E402
from selenite.fit.cluster.parcel import parcel_of  # noqa: E402
from selenite.fit.cluster.scheduler import connected  # noqa: E402
from selenite.fit.cluster.workers import ClusterWorkers  # noqa: E402
from selenite.fit.job import FitJob  # noqa: E402
from selenite.fit.plan import prepare  # noqa: E402
from selenite.fit.request import RunRequest, UnknownRequest  # noqa: E402
from selenite.fit.settings import FitSettings  # noqa: E402
from selenite.problems import BadInput  # noqa: E402

CAMERAS = [f"Camera {i}" for i in range(8)]
PATIENCE = 600  # seconds, on a machine that does much else
TRUTH = "Body:base_color=0.2,0.6,0.4"


@pytest.fixture(scope="module")
def captured(tmp_path_factory):
    """(scene file, its values, camera -> photo): a ball seen from eight sides."""
    home = tmp_path_factory.mktemp("cluster")
    made.studio(base_color=(0.8, 0.4, 0.2), roughness=0.5)
    made.light("Key Light", energy=40)
    for i, name in enumerate(CAMERAS):
        seen = made.camera(name, distance=5.0)
        angle = 2 * math.pi * i / len(CAMERAS)
        seen.location = (5 * math.sin(angle), 0, 5 * math.cos(angle))
        seen.rotation_euler = (0, angle, 0)
    scene = made.save(home / "ball.blend")
    photos = {name: str(home / f"{name}.exr") for name in CAMERAS}
    for name, photo in photos.items():
        words = ["render", scene, "--camera", name, "--out", photo]
        assert main([*words, "--spp", "64", "--set", TRUTH]) == 0
    return scene, made.read(), photos


def plan_of(captured, *, iterations=8):
    """A descent to four photos."""
    _, values, files = captured
    settings = FitSettings(height=12, iterations=iterations, spp=8, tolerance=0, search="off")
    unknowns = tuple(UnknownRequest("Body", name) for name in ("base_color", "roughness"))
    captures = tuple(CaptureRequest(name, files[name]) for name in CAMERAS[:4])
    return prepare(values, RunRequest("ball.blend", unknowns, captures, settings))


def without_times(report):
    """A report without what the clock says."""
    if isinstance(report, dict):
        kept = {name: item for name, item in report.items() if "seconds" not in name}
        return {name: without_times(item) for name, item in kept.items()}
    return [without_times(item) for item in report] if isinstance(report, list) else report


def cluster(count=2):
    """A client of so many processes."""
    return connected(Address(local=count))


def ended(job):
    """The result of a job that runs, without its times."""
    job.join()
    found = job.result()
    return {
        "best": {name: tuple(value) for name, value in found.values_best.items()},
        "losses": found.history.loss.tolist(),
        "samples": found.samples,
        "stopped": found.stopped,
    }


def plain(plan):
    job = FitJob(plan)
    job.start()
    return ended(job)


def started(plan, client, say=lambda _: None, soonest=60.0):
    workers = ClusterWorkers(client, parcel_of(plan), say=say, soonest=soonest)
    job = FitJob(plan, workers=workers)
    job.start()
    return job


def wait_for(job, iterations):
    end = time.monotonic() + PATIENCE
    while job.progress().iteration < iterations:
        assert time.monotonic() < end
        time.sleep(0.01)


def test_eight_captures_on_two_workers_give_the_same_bytes(captured, tmp_path, capsys):
    scene, _, photos = captured
    words = ["fit", scene, "--fit=Body:base_color,roughness", "--height=18", "--spp=8"]
    words += ["--iterations=8", "--picture-spp=4"]
    words += [f"--photo={name}={photo}" for name, photo in photos.items()]
    status, report, _ = command(capsys, *words, f"--out={tmp_path / 'plain'}")
    assert status == 0
    status, other, err = command(capsys, *words, f"--out={tmp_path / 'c'}", "--scheduler=local:2")
    assert status == 0 and "cluster: 4 photos are rendered at once" in err
    one, two = (
        without_times(json.loads((Path(item["folder"]) / "result.json").read_text()))
        for item in (report, other)
    )
    assert json.dumps(one) == json.dumps(two)
    assert one["samples"] > 0


def test_a_worker_that_is_killed_is_replaced(captured):
    plan = plan_of(captured, iterations=15)
    with cluster() as client:
        job = started(plan, client)
        wait_for(job, 3)
        os.kill(next(iter(client.run(os.getpid).values())), signal.SIGKILL)
        assert ended(job) == plain(plan)


@contextmanager
def hanging(pids):
    """Processes that do not move."""
    for pid in pids:
        os.kill(pid, signal.SIGSTOP)
    try:
        yield
    finally:
        for pid in pids:
            os.kill(pid, signal.SIGCONT)


@pytest.mark.parametrize("count", [1, 2], ids=["one of two", "all"])
def test_a_fit_does_without_workers_that_hang(captured, count):
    plan, said = plan_of(captured, iterations=15), []
    with cluster() as client:
        pids = list(client.run(os.getpid).values())
        job = started(plan, client, said.append, soonest=4.0)
        wait_for(job, 3)
        with hanging(pids[:count]):
            assert ended(job) == plain(plan)
    assert any("has not answered for" in text for text in said)


def test_a_worker_that_has_hung_is_asked_again(captured):
    plan, said = plan_of(captured, iterations=5000), []
    with cluster() as client:
        pids = list(client.run(os.getpid).values())
        job = started(plan, client, said.append, soonest=4.0)
        wait_for(job, 3)
        with hanging(pids):
            wait_for(job, 5)
        end = time.monotonic() + PATIENCE
        while not any("answers again" in text for text in said):
            assert time.monotonic() < end and job.progress().running
            time.sleep(0.01)
        wait_for(job, job.progress().iteration + 2)
        job.cancel()
        job.join()


def test_a_worker_of_another_kind_is_named_before_the_first_step(captured, monkeypatch):
    plan = plan_of(captured)
    here = cluster_workers.worker.facts_here()
    with cluster(1) as client:
        for fact, value, words in (
            ("version", "9.9", "it has version .*, the fit is 9.9"),
            ("lanes", not here["lanes"], "AVX2"),
        ):
            monkeypatch.setattr(
                cluster_workers.worker, "facts_here", lambda new={fact: value}: {**here, **new}
            )
            with pytest.raises(BadInput, match=words):
                ClusterWorkers(client, parcel_of(plan))
        monkeypatch.undo()
        parcel = parcel_of(plan)
        other = type(parcel)(parcel.data, parcel.digest, "0" * 64)
        with pytest.raises(BadInput, match="it renders other numbers of the same scene"):
            ClusterWorkers(client, other)


#: The command line, which writes its state every tenth of a second.
WRITES_OFTEN = """
import sys
from selenite.cli import main
from selenite.fit import checkpoint
from selenite.fit.cluster import workers
if __name__ == "__main__":
    checkpoint._EVERY = checkpoint._STATE_EVERY = 0.1
    checkpoint._TIMES = 1.0
    workers.ClusterWorkers.__init__.__kwdefaults__["soonest"] = 2.0
    sys.exit(main(sys.argv[1:]))
"""


@contextmanager
def processes():
    """Starts processes of Python; all end with the test."""
    running = []

    def start(*words, **how):
        running.append(subprocess.Popen([sys.executable, *words], **how))
        return running[-1]

    try:
        yield start
    finally:
        for one in running:
            with suppress(ProcessLookupError):
                one.kill()
            one.wait()


@contextmanager
def scheduler(start, port):
    """A scheduler on a port of this machine and a worker, in processes of their own."""
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    address = ["--host", "127.0.0.1", "--no-dashboard"]
    head = start("-m", "distributed.cli.dask_scheduler", "--port", str(port), *address, **quiet)
    words = ["-m", "distributed.cli.dask_worker", f"tcp://127.0.0.1:{port}", "--no-nanny"]
    hand = start(*words, "--nthreads", "1", "--no-dashboard", **quiet)
    try:
        with distributed.Client(f"tcp://127.0.0.1:{port}", set_as_default=False) as client:
            client.wait_for_workers(1, timeout=60)
        yield head
    finally:
        for one in (head, hand):
            one.kill()
            one.wait()


def test_a_run_goes_on_after_its_scheduler_has_died(captured, tmp_path, capsys, unused_port):
    scene, _, photos = captured
    words = ["fit", scene, "--fit=Body:base_color,roughness", "--height=18", "--spp=8"]
    words += ["--iterations=40", "--tolerance=0", "--picture-spp=4", "--no-until-converged"]
    words += [f"--photo={name}={photos[name]}" for name in CAMERAS[:3]]
    status, report, _ = command(capsys, *words, f"--out={tmp_path / 'plain'}")
    assert status == 0
    script = tmp_path / "often.py"
    script.write_text(WRITES_OFTEN)
    at = f"--scheduler=tcp://127.0.0.1:{unused_port}"
    out = tmp_path / "cluster"
    with processes() as start:
        with scheduler(start, unused_port) as head:
            fit = start(str(script), *words, f"--out={out}", at, stderr=subprocess.PIPE, text=True)
            end = time.monotonic() + PATIENCE
            while not list(out.glob("*.unfinished/fit_*.state")):
                assert time.monotonic() < end and fit.poll() is None
                time.sleep(0.05)
            head.kill()
            err = fit.communicate(timeout=PATIENCE)[1]
            assert fit.returncode == 1 and "the scheduler does not answer" in err
        (unfinished,) = out.glob("*.unfinished")
        with scheduler(start, unused_port):
            status, other, _ = command(capsys, "fit", f"--resume={unfinished}", at)
            assert status == 0
    one, two = (
        without_times(json.loads((Path(item["folder"]) / "result.json").read_text()))
        for item in (report, other)
    )
    assert json.dumps(one) == json.dumps(two)


@pytest.fixture
def unused_port():
    import socket

    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


def test_nobody_at_the_address_is_told(captured, tmp_path, capsys, unused_port, monkeypatch):
    from selenite.fit.cluster import scheduler as connection

    monkeypatch.setattr(connection, "_PATIENCE", 1.0)
    scene, _, photos = captured
    words = ["fit", scene, f"--photo={CAMERAS[0]}={photos[CAMERAS[0]]}", "--fit=Body:roughness"]
    words += [f"--out={tmp_path}", f"--scheduler=tcp://127.0.0.1:{unused_port}"]
    status, report, _ = command(capsys, *words)
    assert status == 2
    assert "no scheduler answers at" in report["problems"][0]["cause"]


def test_a_batch_sends_whole_fits(captured, tmp_path, capsys):
    scene, _, photos = captured
    file = tmp_path / "fits.toml"
    file.write_text(f"""
    [defaults]
    scene = "{scene}"
    photo = {{ "{CAMERAS[0]}" = "{photos[CAMERAS[0]]}" }}
    fit = "Body:base_color"
    height = 12
    iterations = 4
    spp = 4
    picture_spp = 4
    [[fit]]
    name = "one"
    [[fit]]
    name = "missing"
    scene = "nowhere.blend"
    [[fit]]
    name = "two"
    seed = 1
    """)
    status, report, err = command(capsys, "batch", str(file), "--scheduler=local:2")
    assert status == 1 and "1 of 3 fits have no result: 'missing'" in err
    rows = {row["name"]: row for row in report["fits"]}
    assert [rows[name]["status"] for name in ("one", "missing", "two")] == [
        "done", "refused", "done",
    ]  # fmt: skip
    assert "nowhere.blend" in rows["missing"]["reasons"][0]
    out = tmp_path / "fits-fits"
    assert (out / rows["two"]["folder"] / "result.json").is_file()
    assert "fitting" in (out / "two.log").read_text()
    status, again, err = command(capsys, "batch", str(file), "--scheduler=local:1")
    assert "2 of 3 fits have ended before" in err
    assert [row["folder"] for row in again["fits"]] == [row["folder"] for row in report["fits"]]
