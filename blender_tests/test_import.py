# SPDX-License-Identifier: GPL-3.0-or-later
"""From files of a reconstruction to a scene: cameras to a hundredth of a pixel in every format,
near the origin and a million metres away; photos paired; the saved file alone is ready to fit."""

import json
import os
from pathlib import Path

import bpy
import made_scenes as made
import numpy as np
import pytest
import reconstructed
from command_line import command
from reconstructed import imported

from selenite.capture.scene_captures import captures_of
from selenite.importers.to_blender import LABEL, OFFSET, TO_FILE

pytestmark = [pytest.mark.blender, pytest.mark.blender34]

FAR = (1_000_000.0, -2_000_000.0, 300.0)


@pytest.mark.parametrize("offset", [(0.0, 0.0, 0.0), FAR], ids=["near", "far"])
@pytest.mark.parametrize("name", reconstructed.FORMATS)
def test_points_are_seen_where_the_photos_have_them(name, offset, tmp_path, capsys, request):
    truth, words = reconstructed.written(tmp_path, offset)
    report = imported(capsys, words[name], tmp_path / "out.blend")
    request.getfixturevalue("addon")
    scene = reconstructed.opened(tmp_path / "out.blend")
    (item,) = [one for one in scene.objects if one.type == "MESH" and not one.hide_render]
    places = reconstructed.vertices_of(item)
    collection = next(one for one in scene.collection.children if TO_FILE in one)
    to_file = np.array(collection[TO_FILE]).reshape(4, 4)
    assert np.any(collection[OFFSET]) == any(offset)
    in_file = places @ to_file[:3, :3].T + to_file[:3, 3]
    apart = np.linalg.norm(in_file[:, None] - truth.mesh.positions[None], axis=2)
    assert apart.min(axis=1).max() < 1e-8 + 1e-15 * np.abs(offset).max()
    partner = apart.argmin(axis=1)
    captures = captures_of(scene)
    assert [one.camera for one in captures] == [one.label for one in truth.cameras]
    for capture, camera in zip(captures, truth.cameras, strict=True):
        assert Path(capture.photo).name == f"{camera.label}.exr"
        assert capture.size == reconstructed.pebble.SIZE
        aim = camera.project(truth.mesh.positions)[partner]
        found = reconstructed.shown_at(scene, capture, places)
        assert np.abs(found - aim).max() < 0.01
        corner = np.array([[0.0, 0.0], reconstructed.pebble.SIZE])
        pinhole = camera.lens.slopes(corner) * (camera.lens.fx, camera.lens.fy)
        moved = pinhole + (camera.lens.cx, camera.lens.cy) - corner
        assert np.linalg.norm(moved, axis=1).max() > 10  # so there is something to undo
    assert report["cameras_without_photo"] == [] == report["photos_without_camera"]


def test_the_saved_file_alone_is_ready_to_fit(tmp_path, capsys):
    """Without the add-on registered, from another folder: what the command line finds."""
    _, words = reconstructed.written(tmp_path)
    mask = made.photo(tmp_path / "IMG_0002_mask.png", reconstructed.pebble.SIZE, 1.0)
    (tmp_path / "masks").mkdir()
    mask.rename(tmp_path / "masks" / mask.name)
    words = [*words["metashape"], "--masks", str(tmp_path / "masks")]
    report = imported(capsys, words, tmp_path / "out.blend")
    assert any("photos without a mask: 'IMG_0001'" in text for text in report["warnings"])
    assert not hasattr(bpy.types.Scene, "selenite")
    status, found, said = command(capsys, "check", str(tmp_path / "out.blend"))
    assert status == 0, said
    assert [one["id"] for one in found["captures"]] == [f"IMG_000{n}" for n in (1, 2, 3, 4)]
    assert Path(found["captures"][1]["mask"]) == tmp_path / "masks" / mask.name
    assert found["cameras"][0]["width"] == reconstructed.pebble.SIZE[0]
    assert not any(one["spoils"] for one in found["render_settings"])
    # Folder and file move together.
    before = list(tmp_path.iterdir())
    (tmp_path / "moved").mkdir()
    for item in before:
        item.rename(tmp_path / "moved" / item.name)
    status, found, said = command(capsys, "check", str(tmp_path / "moved" / "out.blend"))
    assert status == 0, said
    assert Path(found["captures"][0]["photo"]).parent == tmp_path / "moved" / "photos"


def test_material_and_texture(tmp_path, capsys, request):
    truth, words = reconstructed.written(tmp_path)
    made.photo(tmp_path / "skin.png", (8, 8), 0.2)
    files = reconstructed.pebble.files
    files.write_x3d(tmp_path / "pebble.x3d", truth.mesh, truth.cameras, "skin.png")
    imported(capsys, words["metashape"], tmp_path / "out.blend")
    request.getfixturevalue("addon")
    reconstructed.opened(tmp_path / "out.blend")
    item = bpy.data.objects["pebble"]
    material = item.material_slots[0].material
    node = made.principled(material)
    assert node.inputs["Metallic"].default_value == 0
    (link,) = made.socket(material, "base_color").links
    assert Path(bpy.path.abspath(link.from_node.image.filepath)) == tmp_path / "skin.png"
    uvs = np.empty(len(item.data.loops) * 2, np.float32)
    item.data.uv_layers[0].data.foreach_get("uv", uvs)
    expected = truth.mesh.uvs[truth.mesh.triangles].reshape(-1, 2)
    assert np.abs(uvs.reshape(-1, 2) - expected).max() < 1e-6
    assert all(polygon.use_smooth for polygon in item.data.polygons)


def test_units_distances_and_ground(tmp_path, capsys):
    truth, words = reconstructed.written(tmp_path)
    words = [*words["metashape"], "--scale", "0.5"]
    assert imported(capsys, words, tmp_path / "a.blend")["meters_per_unit"] == 0.5
    first, second = (camera.to_world[:3, 3] for camera in truth.cameras[:2])
    words = [*words[:-2], "--scale-points", "IMG_0001", ",".join(map(str, second)), "3"]
    report = imported(capsys, words, tmp_path / "b.blend")
    assert report["meters_per_unit"] == pytest.approx(3 / np.linalg.norm(first - second))
    ground = ["--ground", "0,0,-0.1", "1,0,-0.1", "0,1,-0.2"]
    report = imported(capsys, [*words, *ground], tmp_path / "c.blend")
    matrix = np.linalg.inv(np.array(report["world_to_file"]))
    plane = np.array([(0, 0, -0.1), (1, 0, -0.1), (0, 1, -0.2)]) @ matrix[:3, :3].T + matrix[:3, 3]
    assert np.abs(plane[:, 2]).max() < 1e-9 * report["meters_per_unit"] + 1e-12
    above = np.array([one.to_world[:3, 3] for one in truth.cameras]) @ matrix[:3, :3].T
    assert (above + matrix[:3, 3])[:, 2].mean() > 0


def test_nothing_that_exists_is_touched(tmp_path, addon):
    _, words = reconstructed.written(tmp_path)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    made.studio()
    scene = bpy.context.scene
    scene.render.pixel_aspect_x = 1.5
    kept = bpy.data.cameras.new("IMG_0001")  # the name of an imported one
    before = reconstructed.everything()
    camera, aspect = scene.camera, scene.render.pixel_aspect_x
    operator(words["metashape"])
    assert scene.camera is camera and scene.render.pixel_aspect_x == aspect
    assert scene.render.resolution_x == 32
    assert set(before) <= set(reconstructed.everything()) and kept.name == "IMG_0001"
    labels = [one[LABEL] for one in scene.objects if LABEL in one]
    assert labels == [f"IMG_000{n}" for n in (1, 2, 3, 4)]
    rows = scene.selenite.captures
    assert [row.camera[LABEL] for row in rows] == labels
    # The photo's pixels are not those of the scene.
    assert rows[0].how.pixel_aspect == pytest.approx(222.2 / 220.0)
    backgrounds = rows[0].camera.data.background_images
    assert backgrounds[0].image == rows[0].photo


def operator(words, **options):
    """The operator with what the command line says."""
    at = {word: words[n + 1] for n, word in enumerate(words) if word.startswith("--")}
    return bpy.ops.selenite.import_reconstruction(
        "EXEC_DEFAULT",
        True,
        filepath=words[0],
        cameras=at.get("--cameras", ""),
        photos=at.get("--photos", ""),
        **options,
    )


def test_the_operator_is_one_undo_step(tmp_path, addon):
    import undo_steps

    _, words = reconstructed.written(tmp_path)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    undo_steps.prepare()
    before = reconstructed.everything()
    assert operator(words["colmap text"]) == {"FINISHED"}
    assert len(bpy.context.scene.selenite.captures) == 4
    undo_steps.undo()
    assert reconstructed.everything() == before
    assert len(bpy.context.scene.selenite.captures) == 0
    undo_steps.redo()
    assert len(bpy.context.scene.selenite.captures) == 4


def test_undistorted_photos_show_points_where_the_camera_has_them(tmp_path, capsys, request):
    """Dots of half a pixel's rim, found by their centres of light, to 0.05 pixels."""
    from selenite import native

    truth, words = reconstructed.written(tmp_path)
    camera = truth.cameras[0]
    width, height = reconstructed.pebble.SIZE
    grid = np.stack(np.meshgrid(np.arange(20, width, 38), np.arange(20, height, 26)), -1)
    dots = grid.reshape(-1, 2) + 0.3  # where the pinhole shows them
    slopes = (dots - (camera.lens.cx, camera.lens.cy)) / (camera.lens.fx, camera.lens.fy)
    at = camera.lens.pixels(slopes)
    assert np.linalg.norm(at - dots, axis=1).max() > 4
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    far = np.min([(x - u) ** 2 + (y - v) ** 2 for u, v in at], axis=0)
    photo = np.repeat(np.exp(-far / (2 * 1.5**2))[..., None], 3, axis=2).astype(np.float32)
    native.image().write_exr(str(tmp_path / "photos" / "IMG_0001.exr"), photo)
    imported(capsys, [*words["metashape"], "--undistort"], tmp_path / "out.blend")
    request.getfixturevalue("addon")
    scene = reconstructed.opened(tmp_path / "out.blend")
    capture = captures_of(scene)[0]
    assert capture.distortion is None
    assert Path(capture.photo) == tmp_path / "out_photos" / "IMG_0001.exr"
    shown = native.image().read(capture.photo)[0][..., 0]
    worst = 0.0
    for u, v in dots:
        near = (abs(x - u) < 7) & (abs(y - v) < 7)
        weight = shown[near] / shown[near].sum()
        centre = np.array([(x[near] * weight).sum(), (y[near] * weight).sum()])
        worst = max(worst, float(np.linalg.norm(centre - (u, v))))
    assert worst < 0.05
    mask = native.image().read(capture.mask)[0][..., 0]
    assert mask[height // 2, width // 2] == 1


def broken_xml(folder, text, with_what):
    path = folder / "cameras.xml"
    path.write_text(path.read_text().replace(text, with_what, 1))


def broken_binary(folder):
    path = folder / "binary" / "images.bin"
    path.write_bytes(path.read_bytes()[:-20])


def broken_colmap(folder):
    path = folder / "text" / "images.txt"
    path.write_text(path.read_text().replace("1 ", "1 nan ", 1))


BROKEN = {
    "doctype": (
        "metashape",
        lambda f: broken_xml(f, "<document", '<!DOCTYPE d [<!ENTITY a "b">]><document'),
    ),
    "not a number": ("metashape", lambda f: broken_xml(f, "<f>222.2", "<f>nan")),
    "no sensors": ("metashape", lambda f: broken_xml(f, "<sensors>", "<others>")),
    "truncated binary": ("colmap binary", broken_binary),
    "pose that is none": ("colmap text", broken_colmap),
    "no json": ("transforms", lambda f: (f / "transforms.json").write_text('{"frames": [')),
    "mesh without faces": ("transforms", lambda f: (f / "pebble.obj").write_text("v 0 0 0\n")),
    "damaged photo": ("metashape", lambda f: (f / "photos/IMG_0003.exr").write_bytes(b"?" * 99)),
    "photo of another shape": (
        "metashape",
        lambda f: made.photo(f / "photos/IMG_0003.exr", (40, 40)),
    ),
}


@pytest.mark.parametrize("fault", BROKEN)
def test_what_is_malformed_creates_nothing(fault, tmp_path, capsys, addon):
    _, words = reconstructed.written(tmp_path)
    name, damage = BROKEN[fault]
    damage(tmp_path)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    made.studio()
    before = reconstructed.everything()
    with pytest.raises(RuntimeError):
        operator(words[name])
    assert reconstructed.everything() == before
    assert len(bpy.context.scene.selenite.captures) == 0
    files = sorted(tmp_path.iterdir())
    status, report, _ = command(
        capsys, "import", *words[name], "--save", str(tmp_path / "out.blend")
    )
    assert status == 2 and sorted(tmp_path.iterdir()) == files
    for problem in report["problems"]:
        assert problem["object"] and problem["cause"] and problem["cure"]


def test_a_failure_half_way_takes_everything_back(tmp_path, addon, monkeypatch):
    from selenite.importers import to_blender

    _, words = reconstructed.written(tmp_path)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    made.studio()
    before = reconstructed.everything()
    real = to_blender._add_row

    def third(camera, *rest):
        if camera.label == "IMG_0003":
            raise MemoryError
        real(camera, *rest)

    monkeypatch.setattr(to_blender, "_add_row", third)
    files = sorted(tmp_path.iterdir())
    for undistort in (False, True):
        with pytest.raises(RuntimeError):
            operator(words["metashape"], undistort=undistort)
        assert reconstructed.everything() == before
        assert len(bpy.context.scene.selenite.captures) == 0
        assert sorted(tmp_path.iterdir()) == files


def test_a_folder_of_the_users_is_not_written_into(tmp_path, capsys):
    _, words = reconstructed.written(tmp_path)
    (tmp_path / "out_photos").mkdir()
    (tmp_path / "out_photos" / "mine.txt").write_text("kept")
    words = [*words["metashape"], "--undistort", "--save", str(tmp_path / "out.blend")]
    status, report, _ = command(capsys, "import", *words)
    assert status == 2 and "out_photos" in report["problems"][0]["object"]
    assert (tmp_path / "out_photos" / "mine.txt").read_text() == "kept"
    assert not (tmp_path / "out.blend").exists()


def test_masks_are_where_the_file_names_them(tmp_path, capsys):
    """Without a folder of masks; those that are not there are named."""
    _, words = reconstructed.written(tmp_path)
    path = tmp_path / "transforms.json"
    content = json.loads(path.read_text())
    for frame in content["frames"]:
        frame["mask_path"] = f"./masks/{Path(frame['file_path']).stem}.png"
    path.write_text(json.dumps(content))
    (tmp_path / "masks").mkdir()
    made.photo(tmp_path / "masks" / "IMG_0002.png", reconstructed.pebble.SIZE, 1.0)
    report = imported(capsys, words["transforms"], tmp_path / "out.blend")
    masks = [one["mask"] for one in report["cameras"]]
    assert masks == [None, str(tmp_path / "masks" / "IMG_0002.png"), None, None]
    (warning,) = [text for text in report["warnings"] if "masks" in text]
    assert warning.endswith(
        "not there: 'photos/IMG_0001.exr', 'photos/IMG_0003.exr', 'photos/IMG_0004.exr'"
    )


def test_poses_and_masks_alone_make_cameras_and_say_what_is_missing(tmp_path, capsys):
    truth, _ = reconstructed.written(tmp_path)
    (tmp_path / "masks").mkdir()
    for camera in truth.cameras:
        made.photo(tmp_path / "masks" / f"{camera.label}_mask.png", reconstructed.pebble.SIZE, 1.0)
    words = [str(tmp_path / "binary"), "--masks", str(tmp_path / "masks")]
    report = imported(capsys, words, tmp_path / "out.blend")
    assert report["captures"] == 0 and len(report["cameras_without_photo"]) == 4
    said = " ".join(report["warnings"])
    for part in ("no mesh, which a fit needs", "cameras without a photo", "masks without a photo"):
        assert part in said
    status, found, _ = command(capsys, "check", str(tmp_path / "out.blend"))
    assert status == 2 and "nothing with faces" in json.dumps(found["problems"])


def test_the_silhouette_counts_where_no_mask_is_given(tmp_path, capsys, request):
    _, words = reconstructed.written(tmp_path)
    (tmp_path / "masks").mkdir()
    made.photo(tmp_path / "masks" / "IMG_0002.png", reconstructed.pebble.SIZE, 1.0)
    about = "no photo has a mask"
    report = imported(capsys, words["metashape"], tmp_path / "all.blend")
    assert any(text.startswith(about) for text in report["warnings"])
    words = [*words["metashape"], "--silhouette", "2", "--masks", str(tmp_path / "masks")]
    report = imported(capsys, words, tmp_path / "out.blend")
    assert not any(text.startswith(about) for text in report["warnings"])
    words[words.index("2")] = "-1"
    status, report, _ = command(capsys, "import", *words, "--save", str(tmp_path / "no.blend"))
    assert status == 2 and report["problems"][0]["object"] == "Argument --silhouette"
    request.getfixturevalue("addon")
    found = captures_of(reconstructed.opened(tmp_path / "out.blend"))
    assert [one.silhouette for one in found] == [2, None, 2, 2]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    assert operator(words, silhouette=True) == {"FINISHED"}
    found = captures_of(bpy.context.scene)
    assert [one.silhouette for one in found] == [1, 1, 1, 1]  # `operator` gives no masks


def test_what_has_no_partner_is_named_both_ways(tmp_path, capsys):
    _, words = reconstructed.written(tmp_path)
    photos = tmp_path / "photos"
    (photos / "IMG_0002.exr").rename(photos / "stray.exr")
    report = imported(capsys, words["metashape"], tmp_path / "out.blend")
    assert report["cameras_without_photo"] == ["IMG_0002"]
    assert report["photos_without_camera"] == ["stray.exr"]
    assert "cameras without a photo: 'IMG_0002'" in report["warnings"]
    assert "photos without a camera: 'stray.exr'" in report["warnings"]
    assert report["captures"] == 3 and len(report["cameras"]) == 4


def test_all_that_is_wrong_with_the_words_is_said_at_once(tmp_path, capsys):
    words = ["nowhere.x3d", "--photos", "none", "--scale-points", "a", "b", "-1"]
    status, report, _ = command(capsys, "import", *words, "--save", str(tmp_path / "out.png"))
    assert status == 2
    said = json.dumps(report["problems"])
    for part in ("nowhere.x3d", "--photos", "--scale-points", "out.png"):
        assert part in said


@pytest.fixture
def buddha():
    folder = Path(os.environ.get("SELENITE_SHARED_DIR", "")) / "data" / "buddha_head"
    if not (folder / "buddha.x3d").is_file():
        pytest.skip("SELENITE_SHARED_DIR does not name the shared captures")
    return folder


def test_a_real_capture(buddha, tmp_path, capsys, request):
    words = [str(buddha / "buddha.x3d"), "--cameras", str(buddha / "cameras.xml")]
    report = imported(capsys, [*words, "--photos", str(buddha / "photos")], tmp_path / "out.blend")
    assert report["captures"] == 13 and report["cameras_without_photo"] == []
    truth = json.loads((buddha / "cameras.json").read_text())
    request.getfixturevalue("addon")
    scene = reconstructed.opened(tmp_path / "out.blend")
    places = reconstructed.vertices_of(bpy.data.objects["buddha"])[::10]
    frames = {Path(frame["file"]).stem: frame for frame in truth["frames"]}
    for capture in captures_of(scene):
        matrix = np.array(frames[capture.camera]["camera_to_world"])
        assert Path(capture.photo).stem == capture.camera
        seen = (places - matrix[:3, 3]) @ matrix[:3, :3]
        front = seen[:, 2] > 0.05
        aim = seen[front, :2] / seen[front, 2:] * (truth["fx"], truth["fy"])
        found = reconstructed.shown_at(scene, capture, places[front])
        assert np.abs(found - aim - (truth["cx"], truth["cy"])).max() < 0.01
