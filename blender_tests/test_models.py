# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite fit --model`: models in turn, judged by a photo that no fit sees."""

import json
import math
from pathlib import Path

import bpy
import made_scenes as made
import pytest
from command_line import command

from selenite.cli import main
from selenite.write_back import body_models

pytestmark = pytest.mark.blender

VIEWS = 4
ALBEDO, EXTINCTION = (0.95, 0.9, 0.8), 2.0


def studio(tmp_path, translucent):
    """A ball in a dim room under a large lamp, seen from four sides: scene, captures of photos."""
    material = made.material(base_color=(0.6, 0.4, 0.3), roughness=0.4)
    ball = made.sphere(material=material)
    ball.data.uv_layers.remove(ball.data.uv_layers[0])
    made.world(color=(0.1, 0.1, 0.1))
    lamp = made.light("Lamp", "AREA", energy=300.0, size=3.0)
    lamp.location = (0.0, 0.0, 4.0)
    for index in range(VIEWS):
        turn = 2 * math.pi * index / VIEWS
        item = made.camera(f"Camera {index}")
        item.location = (5 * math.sin(turn), -5 * math.cos(turn), 0.0)
        item.rotation_euler = (math.pi / 2, 0.0, turn)
    start = made.save(tmp_path / "start.blend")
    if translucent:
        body_models.make_medium(material)
    true = made.save(tmp_path / "true.blend")
    words = ["--spp", "2048" if translucent else "256", "--height", "20"]
    if translucent:
        words += ["--set", f"Body:albedo={','.join(map(str, ALBEDO))}"]
        words += ["--set", f"Body:extinction={EXTINCTION},{EXTINCTION},{EXTINCTION}"]
    rows = []
    for index in range(VIEWS):
        photo = tmp_path / f"{index}.exr"
        camera = ["--camera", f"Camera {index}", "--seed", str(index)]
        assert main(["render", true, "--out", str(photo), *camera, *words]) == 0
        rows.append({"camera": f"Camera {index}", "photo": photo.name, "response": "linear"})
    captures = tmp_path / "captures.json"
    captures.write_text(json.dumps({"schema": 1, "captures": rows}))
    return start, str(captures)


def fitted(capsys, tmp_path, scene, captures, *more):
    return command(
        capsys, "fit", scene, "--model", "auto", "--captures", captures, "--height", "20",
        "--picture-spp", "16", "--iterations", "20", "--spp", "32", "--out", str(tmp_path / "fits"),
        "--save", str(tmp_path / "fitted.blend"), *more,
    )  # fmt: skip


def test_light_through_the_body_is_explained_by_a_medium(tmp_path, capsys):
    scene, captures = studio(tmp_path, translucent=True)
    status, report, err = fitted(capsys, tmp_path, scene, captures)
    assert status == 0, err
    rows = {row["model"]: row for row in report["models"]}
    assert rows["medium"]["kept"] and rows["medium"]["held_out"] < 0.2
    assert rows["medium"]["held_out"] < 0.3 * rows["opaque"]["held_out"]
    found = json.loads((Path(rows["medium"]["folder"]) / "result.json").read_text())["parameters"]
    assert found["Body:albedo"]["value"] == pytest.approx(ALBEDO, abs=0.08)
    assert Path(report["saved"]).is_file()
    bpy.ops.wm.open_mainfile(filepath=rows["medium"]["scene"])
    nodes = bpy.data.materials["Body"].node_tree.nodes
    volume = next(node for node in nodes if node.bl_idname == "ShaderNodeVolumePrincipled")
    density = max(found["Body:extinction"]["value"])
    assert volume.inputs["Density"].default_value == pytest.approx(density, rel=1e-4)
    # The scene that was given is as it was.
    bpy.ops.wm.open_mainfile(filepath=scene)
    nodes = bpy.data.materials["Body"].node_tree.nodes
    assert not any(node.bl_idname == "ShaderNodeVolumePrincipled" for node in nodes)


def test_an_opaque_body_stays_opaque(tmp_path, capsys):
    scene, captures = studio(tmp_path, translucent=False)
    status, report, err = fitted(capsys, tmp_path, scene, captures)
    assert status == 0, err
    rows = {row["model"]: row for row in report["models"]}
    assert rows["opaque"]["kept"] and rows["opaque"]["held_out"] < 0.05
    assert list(rows) == ["opaque"] and "it stays opaque" in err
    assert report["parameters"]["Body:base_color"]["value"] == pytest.approx(
        (0.6, 0.4, 0.3), abs=0.03
    )
    stored = json.loads((Path(report["model_folder"]) / "models.json").read_text())
    assert stored["models"] == report["models"]


def test_what_does_not_go_with_models_is_said_at_once(tmp_path, capsys):
    made.studio()
    made.sphere("Other", made.material("Second"))
    scene = made.save(tmp_path / "scene.blend")
    status, report, _ = command(
        capsys, "fit", scene, "--model", "wax", "--fit", "Body:roughness", "--stages", "none"
    )
    assert status == 2
    lines = [" ".join(problem.values()) for problem in report["problems"]]
    assert any("'wax' is no model" in line for line in lines)
    assert sum("--model chooses what is fitted" in line for line in lines) == 2
    made.photo(tmp_path / "photo.exr")
    status, report, _ = command(
        capsys, "fit", scene, "--model", "auto", "--photo", f"Camera={tmp_path / 'photo.exr'}"
    )
    lines = [" ".join(problem.values()) for problem in report["problems"]]
    assert status == 2 and len(lines) == 2
    assert any("name one, as in --model NAME:auto" in line for line in lines)
    assert any("by a photo that no fit sees, and there are 1" in line for line in lines)
