# SPDX-License-Identifier: GPL-3.0-or-later
"""The recipe for light and a texture on a mesh whose base colour is an image already, as that of an
import: one colour stands for the image until the stage of the new image begins."""

import json

import bpy
import made_scenes as made
import numpy as np
import pytest
from command_line import command
from made_images import decoded
from test_fit_image import picture, requested, truth

from selenite import native
from selenite.fit import fields
from selenite.scene_read.build import build

pytestmark = pytest.mark.blender

COLOUR, IMAGE = "Body:base_color", "Body:base_color_texture"


def linked_board(tmp_path):
    """The board with an image that is wrong, in a file; the mean of that image."""
    item = made.board()
    wrong = np.full((4, 4, 3), 0.6, np.float32)
    wrong[:, :2] = 0.4
    tree = item.data.materials[0].node_tree
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = bpy.data.images.load(picture(tmp_path / "wrong.png", wrong))
    shader = next(one for one in tree.nodes if "Base Color" in one.inputs)
    tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
    return made.save(tmp_path / "linked.blend"), decoded(wrong).mean(axis=(0, 1))


def test_the_recipe_works_where_an_image_is_linked(tmp_path, capsys):
    scene, mean = linked_board(tmp_path)
    field = requested(grid=picture(tmp_path / "truth.png", truth()))
    native_scene = build(fields.with_fields(made.read(), [field]))
    shown = native.core().render(native_scene, "Camera", 24, 24, 1024, seed=99)
    native.image().write_exr(str(tmp_path / "photo.exr"), shown.image)
    saved, stages = tmp_path / "fitted.blend", tmp_path / "stages.json"
    parts = [
        {"name": "light", "parameters": [COLOUR]},
        {"name": "everything", "parameters": [IMAGE]},
    ]
    stages.write_text(json.dumps({"schema": 1, "stages": parts}))
    words = [
        "fit", scene, "--fit", f"{IMAGE},base_color", "--photo",
        f"Camera={tmp_path / 'photo.exr'}", "--grid", f"{IMAGE}=4", "--height", "24", "--spp", "8",
        "--iterations", "60", "--stages", str(stages), "--threads", "1", "--search", "off",
        "--out", str(tmp_path / "out"), "--save", str(saved),
    ]  # fmt: skip
    status, report, said = command(capsys, *words)
    assert status == 0, said
    assert report["parameters"][COLOUR]["initial"] == pytest.approx(mean.tolist(), abs=2e-3)
    assert any(
        "the image of the scene gives way to a new one" in text for text in report["warnings"]
    )
    assert report["parameters"][IMAGE]["texels"] == [4, 4]
    found = native.image().read(str(next((tmp_path / "out").glob("*/Body_base_color.png"))))[0]
    assert np.abs(found - decoded(truth())).mean() < 0.03
    assert saved.exists()
    # The result is read again, over the image of the scene.
    folder = next((tmp_path / "out").iterdir())
    out = tmp_path / "again.exr"
    words = ["render", scene, "--result", str(folder), "--out", str(out), "--spp", "8"]
    status, _, said = command(capsys, *words)
    assert status == 0 and out.exists(), said


def test_both_at_once_are_still_refused(tmp_path, capsys):
    """Without a stage that has the colour alone, nothing says which of the two is meant."""
    scene, _ = linked_board(tmp_path)
    made.photo(tmp_path / "photo.exr", (24, 24))
    words = ["fit", scene, "--fit", f"{IMAGE},base_color", "--stages", "none"]
    words += ["--photo", f"Camera={tmp_path / 'photo.exr'}", "--out", str(tmp_path / "out")]
    status, report, _ = command(capsys, *words)
    assert status == 2
    assert any(problem["object"] == f"Parameter '{COLOUR}'" for problem in report["problems"])
