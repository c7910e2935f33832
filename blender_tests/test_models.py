# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite fit --model`: models in turn, judged by a photo that no fit sees."""

import json
from pathlib import Path

import bpy
import made_scenes as made
import pytest
from command_line import command
from photographed_ball import ALBEDO, studio

pytestmark = pytest.mark.blender


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
