# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite next-camera` and its button: scenes in which one knows from where to look."""

import json
import math
from pathlib import Path

import bpy
import made_scenes as made
import numpy as np
import pytest
import undo_steps
from command_line import command

from selenite import native
from selenite.advice.information.job import BackgroundJob
from selenite.advice.next_camera.candidates import body_of, candidates
from selenite.advice.next_camera.suggestion import suggestion_of
from selenite.capture.request import CaptureRequest
from selenite.fit.capture_render import as_reported
from selenite.fit.request import RunRequest, UnknownRequest, read_run
from selenite.fit.settings import FitSettings
from selenite.scene_read.build import build

pytestmark = pytest.mark.blender


def camera_at(name, location):
    """A camera that looks at the origin."""
    item = made.camera(name)
    item.location = location
    back = np.array(location) / np.linalg.norm(location)
    item.rotation_euler = (math.acos(back[2]), 0.0, math.atan2(back[1], back[0]) + math.pi / 2)
    return item


def two_sided():
    """A ball with one material in front (y < 0) and another one behind, a camera in front."""
    front = made.material("Front", base_color=(0.6, 0.3, 0.2), roughness=0.8)
    back = made.material("Back", base_color=(0.2, 0.3, 0.6), roughness=0.8)
    ball = made.sphere(material=front)
    ball.data.materials.append(back)
    for face in ball.data.polygons:
        face.material_index = int(face.center[1] > 0)
    made.world()
    camera_at("Camera", (0.0, -5.0, 0.0))
    return ball


def plate(name, location, normal_axis, size=20.0):
    """A square, flat along an axis (0 to 2)."""
    mesh = bpy.data.meshes.new(name)
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    points = [np.insert(np.array(c) * size / 2, normal_axis, 0.0) for c in corners]
    mesh.from_pydata([tuple(p) for p in points], [], [(0, 1, 2, 3)])
    item = made.add(name, mesh)
    item.location = location
    mesh.materials.append(made.material(name))
    return item


@pytest.fixture
def scene(tmp_path, capsys):
    """(file, photo): the two-sided ball, and what its camera sees."""
    two_sided()
    path = made.save(tmp_path / "scene.blend")
    photo = tmp_path / "photo.exr"
    render = ("render", path, "--camera=Camera", "--spp=64", "--seed=9", f"--out={photo}")
    assert command(capsys, *render)[0] == 0
    return path, photo


def places_of(values, owners=("Body",)):
    body = body_of(values, owners)
    return body, candidates(values, build(values), [values.cameras[0].name], body)


def test_the_side_that_no_photo_shows_is_where_to_look_from(scene, tmp_path, capsys):
    path, photo = scene
    saved = tmp_path / "next.blend"
    words = ("--fit=Front:base_color", "--fit=Back:base_color", f"--photo=Camera={photo}")
    status, found, printed = command(capsys, "next-camera", path, *words, f"--save={saved}")
    assert status == 0, printed
    assert found["parameters"]["Front:base_color"]["determined"]
    assert not found["parameters"]["Back:base_color"]["determined"]
    assert found["parameters"]["Back:base_color"]["standard_error"] == [None] * 3
    best, worst = found["places"][0], found["places"][-1]
    assert best["parameters"]["Back:base_color"]["determined"]
    assert best["position"][1] > 1.0 and best["gain"] > 1
    assert abs(best["azimuth"]) > 60
    assert worst["position"][1] < -3.5 and worst["gain"] < 0.5
    gains = [place["gain"] for place in found["places"]]
    again = 6  # places that had a second pass come first, among themselves in order
    assert gains[:again] == sorted(gains[:again], reverse=True)
    assert gains[again:] == sorted(gains[again:], reverse=True)
    assert 0.6 < found["same_photo_again_shrinks_to"] <= 1
    assert "determines Back:base_color" in printed and "not determined" in printed
    bpy.ops.wm.open_mainfile(filepath=str(saved))
    camera = bpy.data.objects["Next photo"]
    assert tuple(camera.location) == pytest.approx(best["position"], abs=1e-5)
    towards = np.array(camera.matrix_world)[:3, 2]
    assert towards == pytest.approx(np.array(best["position"]) / 5, abs=1e-4)
    assert camera.data.lens == bpy.data.objects["Camera"].data.lens
    bpy.ops.wm.open_mainfile(filepath=path)
    assert "Next photo" not in bpy.data.objects


def test_a_lamp_that_shines_from_behind_is_looked_at_from_behind(tmp_path, capsys):
    """An opaque ball between the camera and the lamp, black world: in front there is no light."""
    made.sphere(material=made.material(base_color=(0.5, 0.5, 0.5), roughness=0.8))
    made.light("Key", energy=500).location = (0.0, 6.0, 0.0)
    made.light("Fill", energy=500).location = (0.0, -6.0, 0.0)
    made.world(strength=0.0)
    camera_at("Camera", (0.0, -5.0, 0.0))
    path = made.save(tmp_path / "scene.blend")
    photo = tmp_path / "photo.exr"
    assert command(capsys, "render", path, "--spp=64", f"--out={photo}")[0] == 0
    words = ("--fit=Key:power", "--fit=Fill:power", f"--photo=Camera={photo}")
    status, found, printed = command(capsys, "next-camera", path, *words)
    assert status == 0, printed
    assert not found["parameters"]["Key:power"]["determined"]
    assert found["places"][0]["position"][1] > 0
    assert "determines Key:power" in printed


def test_a_camera_without_a_photo_takes_part_and_is_named(scene, tmp_path, capsys):
    path, photo = scene
    bpy.ops.wm.open_mainfile(filepath=path)
    camera_at("Rear", (0.5, 3.0, 0.5))  # nearer than all others: most pixels on the back
    plate("Wall", (0.0, -6.0, 0.0), 1)
    path, saved = made.save(tmp_path / "rear.blend"), tmp_path / "next.blend"
    words = ("--fit=Front:base_color", "--fit=Back:base_color", f"--photo=Camera={photo}")
    status, found, printed = command(capsys, "next-camera", path, *words, f"--save={saved}")
    assert status == 0, printed
    assert "are left out" not in printed
    named = [place for place in found["places"] if place["camera"] == "Rear"]
    assert len(named) == 1
    assert named[0]["where"] == "camera 'Rear'"
    assert named[0]["parameters"]["Back:base_color"]["determined"]
    assert abs(named[0]["azimuth"]) == pytest.approx(
        180 - math.degrees(math.atan2(0.5, 3)), abs=0.1
    )


def test_fitted_values_of_a_result_folder_are_where_it_looks(scene, tmp_path, capsys):
    path, photo = scene
    words = ("--fit=Front:base_color", "--start=Front:base_color=0.3", f"--photo=Camera={photo}")
    quick = ("--iterations=6", "--height=24", "--search=off", f"--out={tmp_path / 'fits'}")
    status, fitted, _ = command(capsys, "fit", path, *words, *quick)
    assert status == 0
    value = fitted["parameters"]["Front:base_color"]["value"]
    for asked in (fitted["folder"], f"{fitted['folder']}/run.json"):
        status, found, printed = command(capsys, "next-camera", asked)
        assert status == 0, printed
        assert found["parameters"]["Front:base_color"]["value"] == pytest.approx(value)
    fitted_error = np.array(fitted["parameters"]["Front:base_color"]["standard_error"])
    expected = np.array(found["parameters"]["Front:base_color"]["standard_error"])
    assert (expected / fitted_error < 3).all() and (expected / fitted_error > 1 / 3).all()
    status, found, _ = command(
        capsys, "next-camera", fitted["folder"], "--set=Front:base_color=0.5"
    )
    assert found["parameters"]["Front:base_color"]["value"] == [0.5] * 3


def test_photo_that_a_fit_has_aligned_is_judged_from_its_aligned_camera(tmp_path, capsys):
    """The photo was taken from beside the scene's camera: unaligned, it seems to be another one."""
    two_sided()
    scene = build(made.read())
    taken = native.core().Photo("Camera", size=(32, 24), alignment=(3.0, 0.0, 0.0))
    picture = native.core().Evaluator(scene).picture(taken, 1024).image
    native.image().write_exr(str(tmp_path / "photo.exr"), picture)
    path = made.save(tmp_path / "scene.blend")
    words = ("--fit=Front:base_color", f"--photo=Camera={tmp_path / 'photo.exr'}", "--align")
    quick = ("--height=24", "--iterations=20", "--search=off", f"--out={tmp_path / 'fits'}")
    status, fitted, printed = command(capsys, "fit", path, *words, *quick)
    assert status == 0, printed
    assert fitted["captures"]["Camera"]["shift"][0] == pytest.approx(3.0, abs=0.3)
    request = read_run(Path(fitted["folder"]) / "run.json")
    relative = []
    for report in (None, fitted):
        found = suggestion_of(
            made.read(), request, {}, as_taken=lambda item, of=report: as_reported(item, of)
        )
        for _ in found._photos.at_photos():
            pass
        relative.append(found._photos.relative)
    assert relative[0] > 0.04 and relative[1] < 0.02
    assert command(capsys, "next-camera", fitted["folder"])[0] == 0


def test_values_that_are_set_and_not_fitted_count_too(scene, capsys):
    """Without light nothing is told about anything, from anywhere."""
    path, photo = scene
    words = ("--fit=Front:base_color", f"--photo=Camera={photo}", "--set=World:strength=0")
    status, found, printed = command(capsys, "next-camera", path, *words)
    assert status == 0, printed
    assert not found["parameters"]["Front:base_color"]["determined"]
    assert "No place adds much to the photos" in printed
    assert "Not determined even then: Front:base_color" in printed


def test_no_place_is_under_the_ground_or_behind_a_wall():
    two_sided()
    plate("Ground", (0.0, 0.0, -1.0), 2)
    plate("Wall", (0.0, 2.0, 0.0), 1)
    body, found = places_of(made.read(), ("Front", "Back"))
    assert body.names == "'Body'" and body.centre == pytest.approx([0, 0, 0], abs=1e-5)
    positions = np.array([place.position for place in found])
    assert len(found) >= 10
    assert (positions[:, 2] > -1).all() and (positions[:, 1] < 2).all()
    assert np.linalg.norm(positions, axis=1) == pytest.approx(np.full(len(found), 5.0))


def test_places_are_on_all_sides_of_a_body_without_ground():
    two_sided()
    _, found = places_of(made.read(), ("Front", "Back"))
    directions = np.array([place.position for place in found]) / 5
    assert len(found) >= 24
    rng = np.random.default_rng(1)
    anywhere = rng.standard_normal((500, 3))
    anywhere /= np.linalg.norm(anywhere, axis=1)[:, None]
    anywhere = anywhere[anywhere[:, 2] > math.sin(math.radians(-60))]
    nearest = np.degrees(np.arccos((anywhere @ directions.T).max(axis=1).clip(-1, 1)))
    assert nearest.max() < 35
    right = next(place for place in found if 60 < place.azimuth < 120)
    assert right.position[0] > 0  # of who stands at -y and looks along +y


def test_a_camera_that_looks_down_has_its_front_where_its_picture_ends_below():
    made.studio()
    _, found = places_of(made.read())
    front = next(place for place in found if place.azimuth == 0 and place.elevation == 12)
    assert front.position[1] < -4  # Blender's camera at rotation zero has +y up


@pytest.mark.parametrize(
    ("words", "text", "cure"),
    [
        (("--fit=Body:colour",), "no material, light or world", "use one of 'Front', 'Back'"),
        (("--fit=Front:colour",), "a material has no parameter 'colour'", "use one of"),
        (("--photo=Nobody=photo.png",), "Camera 'Nobody'", "use one of 'Camera'"),
        (("--set=Front:roughness=7",), "Parameter 'Front:roughness'", "give a value inside"),
        (("--bounds=Front:base_color=0.9,0.1",), "[0.9, 0.1]", "give bounds inside"),
        (("--save=next.txt",), "its ending '.txt'", "end it in .blend"),
        (("--height=0",), "Setting 'height': 0", "give a value inside"),
    ],
)
def test_bad_input_is_named_with_its_cure(scene, capsys, words, text, cure):
    path, photo = scene
    base = () if words[0].startswith("--fit") else ("--fit=Front:base_color",)
    photos = () if words[0].startswith("--photo") else (f"--photo=Camera={photo}",)
    status, found, _ = command(capsys, "next-camera", path, *base, *photos, *words)
    assert status == 2
    lines = [f"{p['object']}: {p['cause']}; {p['cure']}" for p in found["problems"]]
    assert any(text in line and cure in line for line in lines), lines


def test_without_a_photo_or_with_a_damaged_result_it_says_so(scene, tmp_path, capsys):
    path, _ = scene
    status, found, _ = command(capsys, "next-camera", path, "--fit=Front:base_color")
    assert status == 2
    assert found["problems"][0]["cause"] == "there is no photo"
    request = RunRequest(path, (UnknownRequest("Front", "base_color"),))
    (tmp_path / "run.json").write_text(json.dumps(request.as_json()), encoding="utf-8")
    (tmp_path / "result.json").write_text('{"parameters": {}}', encoding="utf-8")
    status, found, _ = command(capsys, "next-camera", str(tmp_path))
    assert status == 2
    assert "it has no fitted values" in found["problems"][0]["cause"]
    status, found, _ = command(capsys, "next-camera", str(tmp_path / "nowhere"))
    assert status == 2
    assert "does not exist" in found["problems"][0]["cause"]


def test_a_body_in_a_closed_box_is_refused_by_the_name_of_the_box(scene, tmp_path, capsys):
    path, photo = scene
    bpy.ops.wm.open_mainfile(filepath=path)
    bpy.ops.mesh.primitive_cube_add(size=4)
    bpy.context.object.name = "Crate"
    path = made.save(tmp_path / "crate.blend")
    words = ("--fit=Front:base_color", f"--photo=Camera={photo}")
    status, found, _ = command(capsys, "next-camera", path, *words)
    assert status == 2
    problem = found["problems"][0]
    assert problem["object"] == "Object 'Body'" and "'Crate'" in problem["cause"]
    bpy.ops.wm.open_mainfile(filepath=path)
    bpy.data.objects["Crate"].visible_camera = False
    path = made.save(tmp_path / "seen.blend")
    assert command(capsys, "next-camera", path, *words)[0] == 0


def test_grids_are_refused(tmp_path, capsys):
    made.smoke()
    path = made.save(tmp_path / "smoke.blend")
    photo = made.photo(tmp_path / "photo.exr")
    words = ("--fit=Smoke:albedo_grid", f"--photo=Camera={photo}")
    status, found, _ = command(capsys, "next-camera", path, *words)
    assert status == 2
    assert found["problems"][0]["object"] == "Parameter 'Smoke:albedo_grid'"


def test_jacobians_are_the_same_whatever_the_number_of_threads():
    made.studio(roughness=0.5)
    native_scene = build(made.read())
    core = native.core()
    asked = [
        core.Unknown("Body", "base_color", 0.0, 1.0, [0.5] * 3),
        core.Unknown("Body", "roughness", 0.02, 1.0, 0.5),
    ]
    photo = core.Photo("Camera", size=(20, 16))
    one, two = (
        core.Evaluator(native_scene, threads=n).jacobian(photo, asked, 64, seed=3) for n in (1, 2)
    )
    assert one.jacobian_a.shape == (4, 16, 20, 3)
    for key in ("image", "variance", "jacobian_a", "jacobian_b"):
        assert (getattr(one, key) == getattr(two, key)).all(), key
    assert one.not_finite == [] and one.dropped == 0
    noise = {"spp": 64, "relative": 0.01, "pixels": 4}
    found = [core.fisher_information(seen, **noise) for seen in (one, two)]
    assert (found[0].normal == found[1].normal).all() and found[0].normal.shape == (4, 4)
    assert (np.linalg.eigvalsh(found[0].precision()) > -1e-9).all()
    same = native_scene.with_values({("Body", "base_color"): [0.5] * 3})
    # The roughness is a difference of pictures, so that no path carries its derivative.
    carried = [("Body", "base_color")]
    film = core.render(same, "Camera", 20, 16, 64, seed=4, parameters=carried)
    both = (one.jacobian_a + one.jacobian_b) / 2
    found = core.reparametrization(native_scene, asked)
    assert found["names"][0] == "Body:base_color[0]"
    # Of a roughness in log(x^3 + 0.15^3) / 3.
    assert found["slope"] == pytest.approx([1, 1, 1, (0.5**3 + 0.15**3) / 0.5**2])
    for own, carried_along in zip(both[:3], film.jacobian, strict=True):
        assert own.mean() == pytest.approx(carried_along.mean(), rel=0.05)
    with pytest.raises(ValueError, match="spp of at least 8"):
        core.Evaluator(native_scene).jacobian(photo, asked, 7)
    with pytest.raises(ValueError, match="20 x 16"):
        core.fisher_information(one, np.ones((20, 16, 3), np.float32), **noise)
    with pytest.raises(ValueError, match="not two different finite points"):
        core.first_hits(native_scene, np.zeros((1, 3)), np.zeros((1, 3)))


def test_a_search_in_its_thread_can_be_cancelled_and_hands_on_what_goes_wrong(tmp_path):
    two_sided()
    photo = made.photo(tmp_path / "photo.exr")
    captures = (CaptureRequest("Camera", str(photo)),)
    settings = FitSettings(height=24)
    unknowns = (UnknownRequest("Front", "base_color"),)
    request = RunRequest("", unknowns, captures, settings)
    job = BackgroundJob(suggestion_of(made.read(), request, {}))
    job.start()
    job.cancel()
    assert job.join() is False and job.work.rows == []
    job = BackgroundJob(suggestion_of(made.read(), request, {}))
    job.work._photos._asked[0] = native.core().Unknown("Nobody", "base_color", 0.0, 1.0, [0.5] * 3)
    job.start()
    with pytest.raises(KeyError, match="Nobody"):
        job.join()


@pytest.mark.usefixtures("addon")
def test_the_button_adds_a_camera_in_one_undo_step_and_says_why(tmp_path):
    from test_interface import draw, prepare_fit

    from selenite.interface import panels, state

    prepare_fit(tmp_path)
    assert "selenite.suggest_camera" in draw(panels.SELENITE_PT_advanced)
    undo_steps.prepare()
    assert bpy.ops.selenite.suggest_camera("EXEC_DEFAULT", True) == {"FINISHED"}
    undo_steps.undo()
    assert "Next photo" not in bpy.context.scene.objects
    undo_steps.redo()
    settings = bpy.context.scene.selenite
    camera = bpy.context.scene.objects["Next photo"]
    assert bpy.context.view_layer.objects.active == camera
    assert camera.data != bpy.context.scene.camera.data
    assert not camera.data.background_images and state.NEXT.job is None
    drawn = draw(panels.SELENITE_PT_advanced)
    assert "Next photo:" in drawn or "No place tells" in drawn
    assert bpy.ops.selenite.start() == {"FINISHED"}
    assert "selenite.suggest_camera" in draw(panels.SELENITE_PT_result)
    assert "selenite.suggest_camera" not in draw(panels.SELENITE_PT_advanced)
    assert bpy.ops.selenite.suggest_camera() == {"FINISHED"}  # at the fitted values
    for row in settings.rows:
        row.enabled = False
    with pytest.raises(RuntimeError, match="no parameter is ticked"):
        bpy.ops.selenite.suggest_camera()
    assert state.NEXT.job is None
