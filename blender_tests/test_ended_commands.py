# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands that are ended by SIGTERM, which is what Ctrl+C is: they end soon and leave nothing."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import bpy
import made_scenes as made
import numpy as np
import pytest
from command_line import command

from selenite import native
from selenite.scene_read.reading.render_depsgraph import GraphRead, at_once

pytestmark = pytest.mark.blender

ROOT = Path(__file__).resolve().parent.parent
COLOUR = (0.2, 0.6, 0.4)


def files(folder):
    return sorted(item.relative_to(folder).as_posix() for item in folder.rglob("*"))


def ended(folder, begun, *words):
    """(exit status, the JSON object, what was said) of a command that is asked to end once
    `begun(its folder of temporary files, what it has said)`. That folder is empty then."""
    temporary = folder / "temporary"
    temporary.mkdir()
    with (folder / "said").open("w+b") as said, (folder / "object").open("w+b") as out:
        process = subprocess.Popen(
            [sys.executable, "-m", "selenite", *words, "--json"],
            env=os.environ | {"PYTHONPATH": str(ROOT / "addon"), "TMPDIR": str(temporary)},
            stdout=out, stderr=said, cwd=folder,
        )  # fmt: skip
        while not begun(temporary, (folder / "said").read_text(errors="replace")):
            assert process.poll() is None, (folder / "said").read_text(errors="replace")
            time.sleep(0.02)
        process.terminate()
        status = process.wait(timeout=300)
    assert files(temporary) == []
    temporary.rmdir()
    found = [(folder / name).read_text(errors="replace") for name in ("object", "said")]
    for name in ("object", "said"):
        (folder / name).unlink()
    return status, json.loads(found[0]), found[1]


def test_an_import_that_is_ended_leaves_nothing(tmp_path):
    """At the first of the photos that it undistorts."""
    import reconstructed

    _, words = reconstructed.written(tmp_path)
    large = native.image().resize(np.full((2, 2, 3), 0.4, np.float32), 2000, 1500)
    for photo in (tmp_path / "photos").iterdir():
        native.image().write_exr(str(photo), large)
    before = files(tmp_path)
    save, photos = tmp_path / "out.blend", tmp_path / "out_photos"
    status, found, _ = ended(
        tmp_path, lambda *_: photos.exists(),
        "import", *words["metashape"], "--undistort", f"--save={save}",
    )  # fmt: skip
    assert (status, found["error"]) == (1, "interrupted")
    assert files(tmp_path) == before


def test_a_render_that_is_ended_does_not_go_on(lit_ball, tmp_path):
    """Hours of samples: at their end the process would be long gone."""
    before = files(tmp_path)
    status, found, _ = ended(
        tmp_path, lambda _, said: "samples per pixel" in said,
        "render", lit_ball, f"--out={tmp_path / 'a.png'}", "--spp=65536", "--height=2000",
    )  # fmt: skip
    assert (status, found["error"]) == (1, "interrupted")
    assert files(tmp_path) == before


def test_a_bake_that_is_ended_leaves_nothing(tmp_path):
    """Nor does the Blender that bakes, or a folder that was made for it."""
    kind = "Gabor" if hasattr(bpy.types, "ShaderNodeTexGabor") else "Musgrave"
    material = made.material("Body")
    node = material.node_tree.nodes.new(f"ShaderNodeTex{kind}")
    made.link(material, node.outputs[0])
    made.sphere("Body", material)
    made.camera()
    made.world()
    scene = made.save(tmp_path / "scene.blend")
    before = files(tmp_path)

    def begun(_temporary, _said):
        return any(tmp_path.glob("selenite-fits/baked/.selenite-*.partial/*/map-0.npy"))

    status, found, _ = ended(tmp_path, begun, "check", scene, "--bake")
    assert (status, found["error"]) == (1, "interrupted")
    assert files(tmp_path) == before


def test_a_check_in_cycles_that_is_ended_costs_itself_alone(lit_ball, tmp_path, capsys):
    photo = tmp_path / "photo.exr"
    status, _, said = command(capsys, "render", lit_ball, f"--out={photo}", "--spp=64")
    assert status == 0, said

    def begun(temporary, _said):
        return any(temporary.glob("selenite-check-*/log.txt"))

    save = tmp_path / "fitted.blend"
    status, found, said = ended(
        tmp_path, begun, "fit", lit_ball, f"--photo=Camera={photo}", "--fit=Body:base_color",
        "--height=16", "--start=Body:base_color=.5", "--iterations=12", "--picture-spp=8",
        "--search=off", f"--out={tmp_path / 'fits'}", f"--save={save}", "--check-in-cycles",
    )  # fmt: skip
    assert (status, found["error"]) == (1, "The check in Cycles failed: interrupted"), said
    assert found["parameters"]["Body:base_color"]["value"] == pytest.approx(COLOUR, abs=0.03)
    assert save.is_file() and (Path(found["folder"]) / "result.json").is_file()
    assert not list(Path(found["folder"]).glob("*cycles*"))


def test_an_interrupt_while_a_scene_is_read_is_raised():
    """Blender would print it and go on with half of the scene."""
    made.sphere()
    made.camera()

    def read(_graph, _check):
        raise KeyboardInterrupt

    def reading():
        yield GraphRead(bpy.context.scene, [], read)

    with pytest.raises(KeyboardInterrupt):
        at_once(reading())
