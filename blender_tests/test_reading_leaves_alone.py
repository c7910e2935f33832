# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading a scene changes nothing of it, and runs nothing of the user's."""

import bpy
import made_geometry as geometry
import made_scenes as made
import pytest

pytestmark = [pytest.mark.blender, pytest.mark.blender34]


def state():
    scene = bpy.context.scene
    render = scene.render
    settings = {
        item.identifier: getattr(render, item.identifier)
        for item in render.bl_rna.properties
        if item.type in {"BOOLEAN", "INT", "FLOAT", "ENUM", "STRING"}
        and not item.is_readonly
        and not getattr(item, "is_array", False)
    }
    # Blender 3 counts a user too many of what stands in the scene's own collection after each copy.
    counts = bpy.app.version >= (4, 0)
    blocks = sorted(
        (type(item).__name__, item.name, item.users if counts else 0)
        for item in bpy.data.user_map()
    )
    return settings, blocks, scene.camera, scene.frame_current, list(scene.timeline_markers)


@pytest.mark.parametrize("camera", [True, False])
@pytest.mark.parametrize("rigid", [True, False])
def test_reading_leaves_nothing_behind(camera, rigid):
    made.triangle()
    if camera:
        made.camera()
    if rigid:
        geometry.cube("Falling")
        bpy.ops.rigidbody.object_add()
    bpy.context.scene.render.use_border = True
    bpy.context.view_layer.update()
    before = state()
    made.read()
    assert state() == before
    with pytest.raises(TypeError, match="SELENITE_SCENE_READ"):
        bpy.context.scene.render.engine = "SELENITE_SCENE_READ"  # it is in no menu any more


def test_the_last_picture_stays(tmp_path):
    made.studio()
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 1, False
    bpy.ops.render.render()
    made.read()
    path = tmp_path / "kept.png"
    bpy.data.images["Render Result"].save_render(str(path))
    kept = bpy.data.images.load(str(path))
    assert tuple(kept.size) == (32, 24)
    assert max(kept.pixels[:3]) > 0.1


def test_handlers_of_the_user_do_not_run_and_are_named():
    made.triangle()
    made.camera()
    called = []

    def switch(*_):
        called.append(1)

    lists = [
        getattr(bpy.app.handlers, name)
        for name in ("render_init", "render_pre", "render_post", "render_complete",
                     "render_stats", "frame_change_pre", "frame_change_post")
    ]  # fmt: skip
    for item in lists:
        item.append(switch)
    try:
        warnings = made.read().warnings
        assert not called
        assert all(item[-1] is switch for item in lists)
        named = [text for text in warnings if "switch" in text]
        assert len(named) == 2 and "render_init" in named[0] and "render_pre" in named[1]
    finally:
        for item in lists:
            item.remove(switch)
    assert not [text for text in made.read().warnings if "runs before a render" in text]


def test_what_fails_while_the_graph_lives_is_raised(monkeypatch):
    made.camera()
    from selenite.scene_read.shading import world

    def fail(_world, _evaluated):
        raise ArithmeticError("in the midst")

    monkeypatch.setattr(world, "read_world", fail)
    before = len(bpy.data.scenes)
    with pytest.raises(ArithmeticError, match="in the midst"):
        made.read()
    assert len(bpy.data.scenes) == before


@pytest.mark.parametrize("fails", [False, True])
@pytest.mark.parametrize("rigid", [False, True])
def test_a_scene_that_is_read_at_another_frame_goes_back_to_its_own(rigid, fails):
    """With a rigid body world the scene itself is rendered, not a copy."""
    from selenite.scene_read.reading.render_depsgraph import GraphRead, at_once

    made.triangle()
    made.camera()
    if rigid:
        geometry.cube("Falling")
        bpy.ops.rigidbody.object_add()
    scene = bpy.context.scene
    scene.frame_set(3)
    seen = []

    def read(depsgraph, _context):
        seen.append(depsgraph.scene_eval.frame_current)
        if fails:
            raise ArithmeticError("in the midst")

    def reading():
        yield GraphRead(scene, [], read, 7)

    if fails:
        with pytest.raises(ArithmeticError, match="in the midst"):
            at_once(reading())
    else:
        at_once(reading())
    assert seen == [7] and scene.frame_current == 3
