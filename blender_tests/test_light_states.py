# SPDX-License-Identifier: GPL-3.0-or-later
"""Light states of photos: read from a scene and its frames, rendered, checked in Cycles, fitted."""

import json

import bpy
import made_scenes as made
import mathutils
import numpy as np
import pytest
from command_line import command
from drawn_panels import FakeLayout

from selenite import native
from selenite.capture.light_states import light_state
from selenite.capture.request import CaptureRequest
from selenite.capture.scene_captures import captures_of
from selenite.cycles_check import render as cycles
from selenite.cycles_check.light_state import under_lights
from selenite.fit.plan import build_scene
from selenite.interface.captures import lights as capture_lights

pytestmark = pytest.mark.blender

SIZE = (32, 24)
LAMPS = {"Left": (-3, -1, 3), "Right": (3, -1, 3), "Top": (0, 3, 3)}


def stage(**values):
    """A ball under three lamps that look at it, and a dim world."""
    made.studio(**({"base_color": (0.6, 0.4, 0.3), "roughness": 0.5} | values))
    made.world(strength=0.1)
    for name, place in LAMPS.items():
        item = made.light(f"{name} bulb", "AREA", energy=300, size=0.8)
        item.name = name
        stand(item, place)
    bpy.context.view_layer.update()


def stand(item, place):
    """Puts a lamp somewhere, looking at the origin."""
    item.location = place
    item.rotation_euler = mathutils.Vector(place).to_track_quat("Z", "Y").to_euler()


def picture(values, lights=None, spp=16, camera="Camera"):
    scene = build_scene(values)
    if lights is not None:
        scene = scene.with_lights(lights)
    return native.core().render(scene, camera, *SIZE, spp, seed=3).image


def state(values, **asked):
    """(light state, lines of problems)"""
    problems = []
    found = light_state(values, CaptureRequest("Camera", "a.exr", id="one", **asked), problems)
    return found, [problem.line() for problem in problems]


def test_one_lamp_at_a_time_is_a_scene_with_that_lamp_only():
    stage()
    values = made.read()
    pictures = {name: picture(values, state(values, lights=(name,))[0]) for name in LAMPS}
    for name in LAMPS:
        for other in LAMPS:
            bpy.data.objects[other].hide_render = other != name
        alone = picture(made.read())
        np.testing.assert_array_equal(pictures[name], alone, err_msg=name)


@pytest.mark.parametrize("normalize", [True, False])
def test_a_lamp_moved_by_its_matrix_is_one_moved_in_blender(normalize):
    stage()
    lamp = bpy.data.objects["Left"]
    if not normalize:
        if not hasattr(lamp.data, "normalize"):
            pytest.skip("lamps of this Blender are always normalised")
        lamp.data.normalize = False
    before = made.read()
    stand(lamp, (-1, -2, 4))
    lamp.scale = (2, 1, 1)
    bpy.context.view_layer.update()
    matrix = tuple(np.array(lamp.matrix_world, np.float64).ravel())
    found, problems = state(before, transforms=(("Left", matrix),))
    assert not problems
    after = picture(made.read())
    np.testing.assert_allclose(picture(before, found), after, rtol=1e-5, atol=1e-7)
    assert not np.allclose(picture(before), after, rtol=0.1)


def test_a_world_that_was_off_is_black():
    stage()
    values = made.read()
    found, _ = state(values, world=False)
    made.world(strength=0.0)
    np.testing.assert_array_equal(picture(values, found), picture(made.read()))


def test_instances_of_one_lamp_are_one_unknown_and_several_objects():
    stage()
    twin = bpy.data.objects.new("Twin", bpy.data.objects["Left"].data)
    bpy.context.scene.collection.objects.link(twin)
    stand(twin, (0, -4, 2))
    bpy.context.view_layer.update()
    values = made.read()
    assert list(values.owners).count("Left bulb") == 1
    assert state(values, lights=("Twin",))[0]["lamps"] == ["Twin"]
    assert state(values, lights=("Left bulb",))[0]["lamps"] == ["Left", "Twin"]
    assert state(values, lights=("Rim",))[1] == [
        "Photo 'one': lamp 'Rim': it is not in the scene, or hidden from renders; "
        "use one of 'Left', 'Right', 'Top', 'Twin'"
    ]


def keyed_stage():
    """'Left' moves from frame 1 to 9, 'Top' renders from frame 5 on no longer."""
    stage()
    left, top = bpy.data.objects["Left"], bpy.data.objects["Top"]
    for frame, place in ((1, LAMPS["Left"]), (9, (-1, -4, 2))):
        stand(left, place)
        left.keyframe_insert("location", frame=frame)
        left.keyframe_insert("rotation_euler", frame=frame)
    for frame, hidden in ((1, False), (5, True)):
        top.hide_render = hidden
        top.keyframe_insert("hide_render", frame=frame)
    bpy.context.scene.frame_set(1)


def test_lamps_of_a_frame_are_those_that_blender_renders_there():
    keyed_stage()
    values = made.read()
    found, problems = state(values, frame=9)
    assert not problems
    assert found["lamps"] == ["Left", "Right"] and list(found["places"]) == ["Left"]
    bpy.context.scene.frame_set(9)
    np.testing.assert_allclose(picture(values, found), picture(made.read()), rtol=1e-5, atol=1e-7)


def test_reading_a_frame_leaves_the_scene_as_it_is():
    keyed_stage()
    scene, left = bpy.context.scene, bpy.data.objects["Left"]
    values = made.read()
    body = bpy.data.objects["Body"]
    body.location = (0.5, 0, 0)  # not keyed
    called = []
    bpy.app.handlers.frame_change_pre.append(called.append)
    state(values, frame=9)
    bpy.app.handlers.frame_change_pre.remove(called.append)
    assert tuple(left.location) == LAMPS["Left"] and tuple(body.location) == (0.5, 0, 0)
    assert scene.frame_current == 1 and not called
    assert len(bpy.data.scenes) == 1


def test_what_else_moves_at_a_frame_is_named():
    keyed_stage()
    body, camera = bpy.data.objects["Body"], bpy.data.objects["Camera"]
    for frame, x in ((1, 0.0), (9, 1.0)):
        body.location.x = camera.location.x = x
        body.keyframe_insert("location", frame=frame)
        camera.keyframe_insert("location", frame=frame)
        bpy.data.lights["Right bulb"].energy = 300 - 10 * x
        bpy.data.lights["Right bulb"].keyframe_insert("energy", frame=frame)
    bpy.context.scene.frame_set(1)
    _, problems = state(made.read(), frame=9)
    assert problems == [
        "Object 'Body': it stands elsewhere at frame 9, unlike in the scene, and only lamps may "
        "move from frame to frame; clear its animation",
        "Camera 'Camera': it stands elsewhere at frame 9, unlike in the scene, and only lamps may "
        "move from frame to frame; clear its animation, and make a camera for each of its places",
        "Lamp 'Right': its 'energy' at frame 9 is not that in the scene, and only lamps may move "
        "from frame to frame; clear that animation, and say in the captures which lamps were on",
    ]


def test_cycles_renders_the_lights_of_a_photo(tmp_path):
    stage()
    scene, values = bpy.context.scene, made.read()
    place = (0.0, -3.0, 3.0)
    found, _ = state(values, lights=("Left",), world=False, transforms=(("Left", place),))
    kept = bpy.data.objects["Left"].matrix_world.copy()
    with under_lights(scene, found):
        seen = cycles.render(scene, "Camera", SIZE, 16, 1, tmp_path / "a.exr")
    np.testing.assert_allclose(bpy.data.objects["Left"].matrix_world, kept, atol=1e-6)
    assert not any(bpy.data.objects[name].hide_render for name in LAMPS)
    assert scene.world.name == "Studio.001" and "Selenite black world" not in bpy.data.worlds
    for name in ("Right", "Top"):
        bpy.data.objects.remove(bpy.data.objects[name])
    bpy.data.objects["Left"].location = place
    made.world(strength=0.0)
    alone = cycles.render(scene, "Camera", SIZE, 16, 1, tmp_path / "b.exr")
    np.testing.assert_allclose(seen, alone, rtol=1e-4, atol=1e-6)


def shoot(folder, shots, spp=256):
    """Photos under the lamps that were really on, and captures.json with those that are claimed:
    {id: (really on, claimed)}."""
    values = made.read()
    entries = []
    for index, (name, (really, claimed)) in enumerate(shots.items()):
        scene = build_scene(values).with_lights(state(values, lights=really)[0])
        film = native.core().render(scene, "Camera", *SIZE, spp, seed=70 + index)
        native.image().write_exr(str(folder / f"{name}.exr"), film.image)
        entry = {"id": name, "camera": "Camera", "photo": f"{name}.exr", "lights": list(claimed)}
        entries.append(entry)
    file = folder / "captures.json"
    file.write_text(json.dumps({"schema": 1, "captures": entries}))
    return str(file)


SHORT = ["--iterations=6", "--height=24", "--search=off", "--picture-spp=8", "--seed=2"]


def test_a_wrong_lamp_is_named_and_a_right_one_is_not(tmp_path, capsys):
    stage()
    scene = made.save(tmp_path / "scene.blend")
    right = {name: ((name,), (name,)) for name in LAMPS}
    wrong = right | {"Top": (("Top",), ("Right",))}
    for shots, named in ((right, []), (wrong, ["Top"])):
        words = ["fit", scene, "--fit=Body:base_color", f"--captures={shoot(tmp_path, shots)}"]
        status, report, printed = command(capsys, *words, *SHORT, f"--out={tmp_path / 'fits'}")
        assert status == 0, printed
        said = [text for text in report["warnings"] if "check the lights" in text]
        assert [text.partition(" is ")[0] for text in said] == [f"Photo '{name}'" for name in named]
        for text in said:
            assert "is better explained by lamp 'Top' than by lamp 'Right'" in text
            assert f"warning: {text}" in printed


def test_exchanged_lamps_are_named_though_the_fit_has_gone_astray(tmp_path, capsys):
    """Found under the wrong lamps, the colour is so dark that the right ones look wrong too."""
    stage(base_color=(0.8, 0.7, 0.5), roughness=0.35)
    bpy.ops.mesh.primitive_plane_add(size=12, location=(0, 0, -1))
    bpy.context.object.data.materials.append(made.material("Floor"))
    made.world(strength=0.0)
    for name, place in {"Left": (-4, -2, 2), "Right": (3, -3, 4)}.items():
        stand(bpy.data.objects[name], place)
    scene = made.save(tmp_path / "scene.blend")
    shots = {"Left": (("Left",), ("Right",)), "Right": (("Right",), ("Left",))}
    words = ["fit", scene, "--fit=Body:base_color,roughness", *SHORT, "--iterations=12"]
    words += ["--start=Body:base_color=0.5,0.5,0.5", "--start=Body:roughness=0.5"]
    words += [f"--captures={shoot(tmp_path, shots)}", f"--out={tmp_path / 'fits'}"]
    status, report, printed = command(capsys, *words)
    assert status == 0, printed
    said = [text for text in report["warnings"] if "check the lights" in text]
    assert [text.partition(" is better")[0] for text in said] == ["Photo 'Left'", "Photo 'Right'"]


def test_a_render_shows_what_the_fit_compares(tmp_path, capsys):
    stage()
    scene = made.save(tmp_path / "scene.blend")
    file = shoot(tmp_path, {name: ((name,), (name,)) for name in LAMPS})
    out = tmp_path / "shown.exr"
    words = ["render", scene, "--spp=16", "--seed=3", f"--out={out}"]
    status, report, printed = command(capsys, *words, f"--captures={file}", "--capture=Top")
    assert status == 0, printed
    assert report["lights"] == "lamp 'Top'" and report["gain"] == [1, 1, 1]
    values = made.read()
    expected = picture(values, state(values, lights=("Top",))[0])
    np.testing.assert_array_equal(native.image().read(str(out))[0], expected)
    # the pictures of a result folder are of the same lights
    fit = ["fit", scene, "--fit=Body:roughness", f"--captures={file}", *SHORT]
    status, report, printed = command(capsys, *fit, f"--out={tmp_path / 'fits'}")
    assert status == 0, printed
    (folder,) = (tmp_path / "fits").iterdir()
    first = native.image().read(str(folder / "Top_initial.exr"))[0]
    assert first.mean() == pytest.approx(expected.mean(), rel=0.05)
    # and a gain that a fit has found acts
    result = json.loads((folder / "result.json").read_text())
    result["captures"] = {"Top": {"gain": [0.5, 1.0, 2.0]}}
    (folder / "result.json").write_text(json.dumps(result))
    status, report, printed = command(capsys, *words, f"--captures={folder}", "--capture=Top")
    assert status == 0, printed
    with_gain = native.image().read(str(out))[0]
    np.testing.assert_allclose(with_gain, expected * (0.5, 1.0, 2.0), rtol=1e-6)


def test_what_is_wrong_with_the_photo_of_a_render_is_named(tmp_path, capsys):
    stage()
    scene = made.save(tmp_path / "scene.blend")
    file = shoot(tmp_path, {"Top": (("Top",), ("Top",)), "Left": (("Left",), ("Rim",))}, spp=1)
    words = ["render", scene, f"--out={tmp_path / 'a.exr'}"]

    def lines(*more):
        status, report, _ = command(capsys, *words, *more)
        assert status == 2
        return [f"{item['object']}: {item['cause']}" for item in report["problems"]]

    assert lines("--capture=Top") == ["Argument --capture: there is no list of photos"]
    assert lines(f"--captures={file}") == ["Argument --capture: which photo is not said"]
    assert lines(f"--captures={file}", "--capture=Up") == ["Photo 'Up': it is not in the list"]
    assert lines(f"--captures={file}", "--capture=Left") == [
        "Photo 'Left': lamp 'Rim': it is not in the scene, or hidden from renders"
    ]
    assert lines(f"--captures={file}", "--capture=Top", "--camera=Camera", "--width=3") == [
        "Argument --camera: the photo of --capture has its own",
        "Argument --width: the photo of --capture has its own",
    ]


@pytest.mark.usefixtures("addon")
def test_the_panel_says_which_lights_were_on(tmp_path):
    stage()
    settings = bpy.context.scene.selenite
    row = settings.captures.add()
    row.camera = bpy.data.objects["Camera"]
    row.photo = bpy.data.images.load(str(made.photo(tmp_path / "a.png")))

    def asked():
        (request,) = captures_of(bpy.context.scene)
        return request.lights, request.world, request.frame

    def drawn():
        layout = FakeLayout()
        capture_lights.draw(layout, row.lights)
        return layout.drawn

    assert asked() == (None, True, None)
    row.lights.mode, row.lights.world = "LAMP", False
    assert asked() == (("",), False, None)
    assert state(made.read(), lights=("",))[1] == [
        "Photo 'one': its lights are a lamp or a collection, and none is chosen; "
        "choose one, or set its lights to all lamps"
    ]
    row.lights.lamp = bpy.data.objects["Top"]
    assert asked() == (("Top",), False, None)
    assert "lamp" in drawn() and "collection" not in drawn()
    group = bpy.data.collections.new("Flash")
    for name in ("Left", "Right", "Body"):
        group.objects.link(bpy.data.objects[name])
    row.lights.mode, row.lights.collection = "COLLECTION", group
    row.lights.use_frame, row.lights.frame = True, 4
    assert asked() == (("Left", "Right"), False, 4)
    row.lights.mode = "NONE"
    assert asked() == ((), False, 4)
