# SPDX-License-Identifier: GPL-3.0-or-later
"""The worker of the check in Cycles: what it asks both renderers for, which of two pictures it
takes from which, what the mask leaves out, and that the file's compositor does not act."""

from types import SimpleNamespace

import bpy
import made_scenes as made
import numpy as np
import pytest

from selenite import native
from selenite.capture.request import CaptureRequest
from selenite.cycles_check import render as cycles_render
from selenite.cycles_check import worker
from selenite.cycles_check.compare import Estimate
from selenite.cycles_check.job import CheckJob
from selenite.fit.request import RunRequest
from selenite.fit.settings import FitSettings
from selenite.problems import BadInput

pytestmark = [pytest.mark.blender, pytest.mark.blender34]

#: Radiance by channel of what Selenite and Cycles "render" here and of the photo; standard errors.
OURS, CYCLES, PHOTO = (0.3, 0.6, 1.2), (0.4, 0.5, 0.9), (0.2, 0.8, 0.5)
OURS_ERROR, CYCLES_ERROR = 0.02, 0.01
SIZE = (32, 24)  # width, height


def picture(colour):
    return np.tile(np.array(colour, np.float32), (SIZE[1], SIZE[0], 1))


def stored(path):
    """(h, w, 3) of a file as Blender reads it: what is below 0 too."""
    image = bpy.data.images.load(str(path))
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(image.size[1], image.size[0], -1)[::-1, :, :3]


@pytest.fixture
def folder(tmp_path):
    """A check's folder: the scene, and a photo whose right half is far off and masked."""
    made.studio(base_color=(0.8, 0.8, 0.8), roughness=0.5)
    made.save(tmp_path / "scene.blend")
    (tmp_path / "out").mkdir()
    pixels, mask = picture(PHOTO), picture((1, 1, 1))
    pixels[:, SIZE[0] // 2 :], mask[:, SIZE[0] // 2 :] = 9, 0
    native.image().write_exr(str(tmp_path / "photo.exr"), pixels)
    native.image().write_png(str(tmp_path / "mask.png"), mask)
    return tmp_path


def request(folder, **settings):
    """As the job writes it."""
    given = {"height": SIZE[1], "picture_spp": 40, "seed": 21, "depth": 6, "threads": 1}
    capture = CaptureRequest("Camera", str(folder / "photo.exr"), str(folder / "mask.png"))
    run = RunRequest("", (), (capture,), FitSettings(**given | settings))
    return {
        "scene": bpy.context.scene.name,
        "scripts": False,
        "run": run.as_json(),
        "values": {"Body:base_color": [0.1, 0.2, 0.3]},
        "grids": {},
        "surfaces": {},
        "taken": {},
        "environment": "",
    }


@pytest.fixture
def asked(monkeypatch):
    """Both renderers answer with one colour; what they are asked for is kept."""
    noted = SimpleNamespace(native=[], cycles=[])

    class Evaluator:
        def __init__(self, scene, **options):
            self.asked = {"scene": scene, **options}

        def picture(self, photo, spp, **options):
            width, height = photo.size
            noted.native.append({"camera": photo.camera, "size": (width, height), "spp": spp,
                                 "frame": photo.frame, **self.asked, **options})  # fmt: skip
            error = np.full((height, width, 3), OURS_ERROR, np.float32)
            return SimpleNamespace(image=picture(OURS), standard_error=error)

    def estimate(scene, camera, size, samples, seeds, path, progress, pixel_aspect):
        noted.cycles.append({"camera": camera, "size": size, "samples": samples,
                             "seeds": list(seeds), "pixel_aspect": pixel_aspect})  # fmt: skip
        colour = made.socket(bpy.data.materials["Body"], "base_color").default_value
        noted.colour = tuple(colour)[:3]
        progress(0.5)
        mean = picture(CYCLES).astype(np.float64)
        return Estimate(mean, np.full(mean.shape, CYCLES_ERROR**2))

    monkeypatch.setattr(native.core(), "Evaluator", Evaluator)
    monkeypatch.setattr(cycles_render, "estimate", estimate)
    return noted


def silent(fraction, text):
    pass


def test_both_renderers_are_asked_for_the_same_picture(folder, asked):
    report = worker.run(folder, request(folder), silent)
    (ours,), (theirs,) = asked.native, asked.cycles
    assert (ours["camera"], theirs["camera"]) == ("Camera", "Camera")
    assert ours["size"] == theirs["size"] == SIZE
    assert theirs["samples"] == 10 and ours["spp"] == 40
    assert theirs["seeds"] == [21, 22, 23, 24]
    assert (ours["seed"], ours["depth"], ours["threads"]) == (21, 6, 1)
    assert ours["frame"] == (pytest.approx(4 / 3), 0, 0)
    assert theirs["pixel_aspect"] == pytest.approx(1)
    assert (report["samples"], report["seeds"]) == (40, 4)
    # The values given, in the file as in the native scene, and not those of the scene.
    assert asked.colour == pytest.approx((0.1, 0.2, 0.3))
    assert ours["scene"].get("Body", "base_color") == pytest.approx([0.1, 0.2, 0.3])


def test_each_row_is_the_one_less_the_other(folder, asked):
    """By hand: the mean difference over the mean of what it is compared with."""
    row = worker.run(folder, request(folder), silent)["photos"]["Camera"]
    for name, one, other in (
        ("native_against_cycles", OURS, CYCLES),
        ("cycles_against_photo", CYCLES, PHOTO),
        ("native_against_photo", OURS, PHOTO),
    ):
        difference, scale = np.subtract(one, other), np.mean(other)
        found = row[name]
        assert found["relative_bias"] == pytest.approx(difference.mean() / scale, rel=1e-3), name
        assert found["relative_bias_rgb"] == pytest.approx(difference / scale, rel=1e-3), name
        rmse = np.sqrt((difference**2).mean()) / scale
        assert found["relative_rmse"] == pytest.approx(rmse, rel=1e-3), name
    noise = np.hypot(OURS_ERROR, CYCLES_ERROR) / np.mean(CYCLES)
    assert row["native_against_cycles"]["relative_rmse_noise"] == pytest.approx(noise, rel=1e-3)
    noise = CYCLES_ERROR / np.mean(PHOTO)
    assert row["cycles_against_photo"]["relative_rmse_noise"] == pytest.approx(noise, rel=1e-3)


def test_pictures_show_what_their_names_say(folder, asked):
    said = []
    worker.run(folder, request(folder), lambda *words: said.append(words))
    read = {
        name: stored(folder / "out" / f"Camera_{name}.exr")
        for name in ("native", "native_sem", "cycles", "cycles_sem", "cycles_minus_native",
                     "cycles_minus_photo")
    }  # fmt: skip
    assert read["native"][0, 0] == pytest.approx(OURS)
    assert read["cycles"][0, 0] == pytest.approx(CYCLES)
    assert read["native_sem"] == pytest.approx(OURS_ERROR)
    assert read["cycles_sem"] == pytest.approx(CYCLES_ERROR)
    assert read["cycles_minus_native"][0, -1] == pytest.approx(np.subtract(CYCLES, OURS))
    assert read["cycles_minus_photo"][0, 0] == pytest.approx(np.subtract(CYCLES, PHOTO))
    assert (read["cycles_minus_photo"][:, -1] == 0).all(), "masked"
    assert (folder / "out" / "cycles_check.png").is_file()
    # Our picture is the first fifth of the work; Cycles has said that it is half way.
    assert said[-1] == (pytest.approx(0.6), "Cycles' picture of Camera")


def test_values_that_cannot_be_written_are_a_problem(folder, asked):
    wrong = request(folder) | {"values": {"Body:gloss": [1.0]}}
    with pytest.raises(BadInput, match="Body:gloss"):
        worker.run(folder, wrong, silent)
    assert not asked.cycles


def composited(scene, colour):
    """The scene's own renders are one colour, by its compositor."""
    scene.use_nodes = True
    tree = scene.node_tree
    node = tree.nodes.new("CompositorNodeRGB")
    node.outputs[0].default_value = (*colour, 1.0)
    output = next(n for n in tree.nodes if n.bl_idname == "CompositorNodeComposite")
    tree.links.new(node.outputs[0], output.inputs["Image"])
    scene.render.use_compositing = True


def test_the_process_compares_with_what_counts_of_the_photo(folder):
    """The whole way, in a process of its own: nothing but a sky of 0.5 is seen, and the photo is
    0.4 where it counts."""
    composited(bpy.context.scene, (5.0, 0.0, 0.0))
    pixels = picture((0.4, 0.4, 0.4))
    pixels[:, SIZE[0] // 2 :] = 9
    native.image().write_exr(str(folder / "photo.exr"), pixels)
    run = RunRequest.from_json(request(folder, picture_spp=4)["run"])
    bpy.data.objects["Body"].hide_render = True
    made.triangle("Behind", made.material("Grey")).location = (0, 0, -900)
    job = CheckJob(bpy.context.scene, run, {})
    try:
        job.start()
        report = job.result()
        shown = native.image().read(str(job.folder / "out" / "Camera_cycles.exr"))[0]
    finally:
        job.close()
    assert shown == pytest.approx(0.5, rel=1e-3), "the sky, not the compositor's colour"
    row = report["photos"]["Camera"]
    assert row["cycles_against_photo"]["relative_bias"] == pytest.approx(0.25, rel=1e-2)
    assert row["native_against_photo"]["relative_bias"] == pytest.approx(0.25, rel=1e-2)
    assert row["native_against_cycles"]["relative_bias"] == pytest.approx(0, abs=1e-3)
