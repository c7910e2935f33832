# SPDX-License-Identifier: GPL-3.0-or-later
"""The box of a capture in the panel: what it asks for, what it draws, the preview of its mask."""

import bpy
import made_scenes as made
import numpy as np
import pytest
from drawn_panels import FakeLayout

from selenite.capture.panel_rows import write_row
from selenite.capture.request import CaptureRequest
from selenite.capture.scene_captures import captures_of
from selenite.fit.request import RunRequest
from selenite.interface.captures import photo as capture_photo
from selenite.interface.pictures.mask import IMAGE
from selenite.scene_read.lens import LensDistortion

pytestmark = [pytest.mark.blender, pytest.mark.blender34, pytest.mark.usefixtures("addon")]


@pytest.fixture
def row(tmp_path):
    made.studio(base_color=(0.8, 0.2, 0.1))
    settings = bpy.context.scene.selenite
    bpy.ops.selenite.refresh_rows()
    bpy.ops.selenite.add_capture()
    settings.captures[0].photo = bpy.data.images.load(str(made.photo(tmp_path / "photo.png")))
    settings.height = 24
    return settings.captures[0]


def asked():
    (request,) = captures_of(bpy.context.scene)
    return request


def drawn(row):
    layout = FakeLayout()
    capture_photo.draw(layout, row.how)
    return layout.drawn


def test_nothing_is_asked_for_at_first(row):
    plain = CaptureRequest("Camera", asked().photo)
    assert asked() == plain
    assert set(asked().as_json()) == {"camera", "photo"}
    assert drawn(row) == ["expanded"]


def test_all_that_is_set_reaches_the_request(row):
    how = row.how
    how.exclude_path = "/photos/hand.png"
    how.use_silhouette, how.silhouette = True, 3
    how.background, how.tolerance = "BORDER", 0.125
    how.response, how.gamma = "GAMMA", 2.2
    how.use_clip, how.clip = True, (0.125, 0.875)
    how.gain, how.align = "RGB", True
    how.use_size, how.size = True, (400, 600)
    how.use_crop, how.crop = True, (10, 20, 300, 500)
    how.use_pixel_aspect, how.pixel_aspect = True, 1.5
    how.use_distortion = True
    lens = {"fx": 512.0, "fy": 511.5, "cx": 200.5, "cy": 300.25, "k1": 0.125, "p2": -0.25}
    for name, value in lens.items():
        setattr(how, name, value)
    expected = CaptureRequest(
        "Camera",
        asked().photo,
        exclude="/photos/hand.png",
        silhouette=3,
        background="border:0.125",
        response="gamma:2.2",
        clip=(0.125, 0.875),
        gain="rgb",
        align=True,
        size=(400, 600),
        crop=(10, 20, 300, 500),
        pixel_aspect=1.5,
        distortion=LensDistortion(**lens),
    )
    assert asked() == expected
    # And survives a run.json.
    run = RunRequest("", (), (expected,))
    assert RunRequest.from_json(run.as_json()).captures == (expected,)
    how.background, how.background_color = "COLOR", (0.25, 0.5, 1.0)
    how.response, how.response_path = "TABLE", "/photos/camera.csv"
    assert asked().background == "0.25,0.5,1:0.125"
    assert asked().response == "/photos/camera.csv"


@pytest.mark.parametrize(
    "said",
    [
        {
            "mask": "/photos/mask.png",
            "exclude": "/photos/hand.png",
            "silhouette": 0,
            "hold_out": True,
        },
        {"background": "border:0.125", "response": "linear", "gain": "scalar", "align": True},
        {"background": "0.25,0.5,1:0.05", "response": "gamma:1.8", "clip": (0.125, 0.875)},
        {"response": "/photos/table.csv", "world": False, "frame": -3, "distortion": False},
        {"size": (400, 600), "crop": (0, 0, 30, 50), "pixel_aspect": 0.5},
        {"distortion": LensDistortion(512.0, 511.5, 200.5, 300.25, k1=0.125, b2=-2.0)},
    ],
)
def test_a_row_says_what_was_written_into_it(row, said):
    wanted = CaptureRequest("Camera", asked().photo, **said)
    write_row(row, wanted)
    assert asked() == wanted


def test_rows_of_earlier_files_keep_their_properties():
    """Names and types in a .blend; a menu's items by their numbers."""
    kept = {
        "": "mask_path:STRING",
        "how": "exclude_path:STRING use_silhouette:BOOLEAN silhouette:INT background:ENUM "
        "background_color:FLOAT tolerance:FLOAT response:ENUM gamma:FLOAT response_path:STRING "
        "use_clip:BOOLEAN clip:FLOAT gain:ENUM align:BOOLEAN hold_out:BOOLEAN use_size:BOOLEAN "
        "size:INT use_crop:BOOLEAN crop:INT use_pixel_aspect:BOOLEAN pixel_aspect:FLOAT "
        "use_distortion:BOOLEAN undistorted:BOOLEAN fx:FLOAT fy:FLOAT cx:FLOAT cy:FLOAT k1:FLOAT "
        "k2:FLOAT k3:FLOAT k4:FLOAT p1:FLOAT p2:FLOAT p3:FLOAT p4:FLOAT b2:FLOAT",
        "lights": "mode:ENUM lamp:POINTER collection:POINTER world:BOOLEAN use_frame:BOOLEAN "
        "frame:INT",
    }
    items = {
        "background": "NONE BORDER COLOR",
        "response": "AUTO SRGB LINEAR GAMMA TABLE",
        "gain": "NONE SCALAR RGB",
        "mode": "ALL LAMP COLLECTION NONE",
    }
    row = bpy.context.scene.selenite.captures.add()
    for group, names in kept.items():
        found = (getattr(row, group) if group else row).bl_rna.properties
        for name, _, kind in (item.partition(":") for item in names.split()):
            assert found[name].type == kind, name
            if kind == "ENUM":
                numbered = {item.value: item.identifier for item in found[name].enum_items}
                assert [numbered[at] for at in range(len(numbered))] == items[name].split()


def test_the_box_draws_what_is_switched_on(row):
    row.how.expanded = True
    plain = drawn(row)
    assert "selenite.preview_mask" in plain
    for switch, name in (
        ("use_silhouette", "silhouette"),
        ("use_clip", "clip"),
        ("use_size", "use_crop"),
        ("use_distortion", "k3"),
        ("use_pixel_aspect", "pixel_aspect"),
    ):
        assert switch in (*plain, *drawn(row)) and name not in plain
        setattr(row.how, switch, True)
        assert name in drawn(row)
    assert "crop" not in drawn(row)
    row.how.use_crop = True
    assert "crop" in drawn(row)
    row.how.background, row.how.response = "COLOR", "TABLE"
    assert {"background_color", "tolerance", "response_path"} <= set(drawn(row))


def test_the_preview_is_red_where_the_photo_does_not_count(row):
    row.how.use_silhouette, row.how.silhouette = True, 0
    bpy.context.scene.selenite.rows[0].enabled = True
    assert bpy.ops.selenite.preview_mask() == {"FINISHED"}
    image = bpy.data.images[IMAGE]
    assert tuple(image.size) == (32, 24)
    pixels = np.empty(32 * 24 * 4, np.float32)
    image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(24, 32, 4)
    # The ball, of radius 1 seen from 5 away, is 9 pixels in radius: grey, and red around it.
    middle, corner = pixels[12, 16], pixels[0, 0]
    assert middle[0] == pytest.approx(middle[1]) == pytest.approx(0.4, abs=0.01)
    assert corner[0] > corner[1] + 0.4
    counted = np.isclose(pixels[..., 0], pixels[..., 1])
    assert 0.5 * np.pi * 9**2 < counted.sum() < np.pi * 9**2
    # Upside down, a mask would be on the wrong side.
    row.how.use_silhouette = False
    half = np.zeros((24, 32, 3), np.float32)
    half[:8] = 1
    from selenite import native

    path = bpy.path.abspath(row.photo.filepath).replace("photo.png", "mask.png")
    native.image().write_png(path, half)
    row.mask_path = path
    assert bpy.ops.selenite.preview_mask() == {"FINISHED"}
    image.pixels.foreach_get(pixels.ravel())
    pixels = np.array(image.pixels[:], np.float32).reshape(24, 32, 4)
    counted = np.isclose(pixels[..., 0], pixels[..., 1])
    assert counted[-1].all() and not counted[0].any(), "the first row of an image is its lowest"


def test_the_preview_says_what_is_wrong(row):
    row.how.use_clip, row.how.clip = True, (0.99, 1.0)
    with pytest.raises(RuntimeError, match="no pixel of it can be used"):
        bpy.ops.selenite.preview_mask()
    row.how.use_clip = False
    row.how.response, row.how.response_path = "TABLE", ""
    with pytest.raises(RuntimeError, match="Response 'no table is chosen'"):
        bpy.ops.selenite.preview_mask()
