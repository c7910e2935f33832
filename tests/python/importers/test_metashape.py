# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras of Metashape's XML, written from known numbers."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from selenite.importers.read import read_reconstruction
from selenite.importers.reconstruction import ReconstructionError
from selenite.scene_read.lens import LensDistortion

sys.path.insert(0, str(Path(__file__).parent))

from known import FULL, HEIGHT, MOST, WIDTH, Known, Lens, known, seen, text, worst  # noqa: E402

#: Chunk to world.
SCALE = 0.31
TURN = known(1)[0].rotation
MOVED = np.array([0.4, -1.3, 2.2])


def calibration(lens: Lens = FULL, kind: str = "adjusted", extra: str = "") -> str:
    """p1 and p2 in Metashape's order."""
    values = {
        "f": lens.fy, "cx": lens.cx - WIDTH / 2, "cy": lens.cy - HEIGHT / 2,
        "b1": lens.fx - lens.fy, "k1": lens.k1, "k2": lens.k2, "k3": lens.k3,
        "p1": lens.p2, "p2": lens.p1,
    }  # fmt: skip
    inner = "".join(f"<{name}>{value!r}</{name}>" for name, value in values.items())
    size = f'<resolution width="{WIDTH}" height="{HEIGHT}"/>'
    return f'<calibration type="frame" class="{kind}">{size}{inner}{extra}</calibration>'


def sensor(inner: str, number: int = 0, kind: str = "frame") -> str:
    size = f'<resolution width="{WIDTH}" height="{HEIGHT}"/>'
    return f'<sensor id="{number}" label="lens" type="{kind}">{size}{inner}</sensor>'


def camera(one: Known, number: int, sensor_id: int = 0, moved: np.ndarray = MOVED) -> str:
    matrix = np.eye(4)
    matrix[:3, :3] = TURN.T @ one.rotation.T
    matrix[:3, 3] = TURN.T @ (one.centre - moved) / SCALE
    return (
        f'<camera id="{number}" sensor_id="{sensor_id}" component_id="0" label="{one.label}">'
        f"<transform>{text(matrix)}</transform><orientation>1</orientation></camera>"
    )


def transform(moved: np.ndarray = MOVED) -> str:
    return (
        f'<transform><rotation locked="true">{text(TURN)}</rotation><translation>{text(moved)}'
        f"</translation><scale>{SCALE!r}</scale></transform>"
    )


def document(sensors: str, cameras: str, rest: str | None = None) -> str:
    component = (
        f'<components active_id="0"><component id="0">{transform()}</component></components>'
    )
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n<document version="2.0.0"><chunk label="Chunk 1">'
        f"<sensors>{sensors}</sensors>{component if rest is None else rest}"
        f"<cameras>{cameras}</cameras></chunk></document>"
    )


def all_of(cameras: list[Known], moved: np.ndarray = MOVED) -> str:
    return "".join(camera(one, number, moved=moved) for number, one in enumerate(cameras))


def written(folder: Path, content: str) -> Path:
    path = folder / "cameras.xml"
    path.write_text(content, encoding="utf-8")
    return path


def test_reprojection_with_distortion_and_component(tmp_path: Path) -> None:
    path = written(tmp_path, document(sensor(calibration()), all_of(known())))
    found = read_reconstruction(path)
    assert worst(found, known()) < MOST
    assert found.remarks == () and found.name == "cameras"
    assert found.cameras[0].photo == "IMG_0000.JPG"


def test_the_transform_of_an_old_chunk_counts(tmp_path: Path) -> None:
    path = written(tmp_path, document(sensor(calibration()), all_of(known()), transform()))
    assert worst(read_reconstruction(path), known()) < MOST


def test_coordinates_of_a_million_metres_keep_their_digits(tmp_path: Path) -> None:
    far = 1e6
    moved = MOVED + far
    component = f'<components><component id="0">{transform(moved)}</component></components>'
    cameras = known(at=far)
    content = document(sensor(calibration()), all_of(cameras, moved), component)
    assert worst(read_reconstruction(written(tmp_path, content)), cameras, far) < MOST


def test_cameras_in_groups_are_read_and_those_without_pose_are_named(tmp_path: Path) -> None:
    cameras = known()
    inner = f'<group id="0" label="G"><group id="1">{camera(cameras[0], 0)}</group></group>'
    inner += "".join(camera(one, number) for number, one in enumerate(cameras) if number)
    inner += '<camera id="8" sensor_id="0" label="lost"/>'
    inner += camera(replace(cameras[1], label="off"), 9).replace(
        "<camera ", '<camera enabled="false" '
    )
    found = read_reconstruction(written(tmp_path, document(sensor(calibration()), inner)))
    assert worst(found, cameras) < MOST
    assert found.remarks == (
        "camera 'lost': it has no pose: Metashape did not align it",
        "camera 'off': it is disabled in Metashape",
    )


def test_equal_labels_are_told_apart_by_their_groups(tmp_path: Path) -> None:
    first, second = known(2)
    second = replace(second, label=first.label)
    inner = "".join(
        f'<group id="{number}" label="{name}">{camera(one, number)}</group>'
        for number, (name, one) in enumerate((("day 1", first), ("day 2", second)))
    )
    found = read_reconstruction(written(tmp_path, document(sensor(calibration()), inner)))
    cameras = [replace(first, label="day 1/" + first.label),
               replace(second, label="day 2/" + first.label)]  # fmt: skip
    assert worst(found, cameras) < MOST and found.cameras[0].photo == cameras[0].label


def test_the_adjusted_calibration_comes_before_the_initial_one(tmp_path: Path) -> None:
    both = calibration(Lens(400.0, 400.0), "initial") + calibration()
    path = written(tmp_path, document(sensor(both), all_of(known())))
    assert worst(read_reconstruction(path), known()) < MOST


def test_without_calibration_focal_length_and_pixel_size_count(tmp_path: Path) -> None:
    lens = Lens(500.0, 400.0)
    inner = "".join(
        f'<property name="{name}" value="{value}"/>'
        for name, value in (("focal_length", 50), ("pixel_width", 0.1), ("pixel_height", 0.125))
    )
    path = written(tmp_path, document(sensor(inner), all_of(known(lens=lens))))
    found = read_reconstruction(path)
    assert worst(found, known(lens=lens)) < MOST
    assert "no calibration" in found.remarks[0]


def test_every_camera_has_its_own_sensor(tmp_path: Path) -> None:
    first, second = known(2)
    second = replace(second, lens=Lens(610.0, 610.0))
    sensors = sensor(calibration()) + sensor(calibration(second.lens), 1)
    cameras = camera(first, 0) + camera(second, 1, sensor_id=1)
    found = read_reconstruction(written(tmp_path, document(sensors, cameras)))
    assert worst(found, [first, second]) < MOST


#: Of the second sensor in the axes of the first: its turn, and its place in units of the chunk.
ASIDE, OFFSET = known(2)[1].rotation.T, np.array([0.2, -0.1, 0.05])


def rig(second: str, placed: int = 1) -> tuple[str, list[Known]]:
    """A file whose second camera has a master instead of a pose, and where the cameras are.
    second: its label. placed: which of both sensors has a pose in the rig."""
    lens = Lens(610.0, 610.0)
    first = known(1)[0]
    turn, moved = (ASIDE, OFFSET) if placed else (ASIDE.T, -ASIDE.T @ OFFSET)
    pose = f"<rotation>{text(turn)}</rotation><location>{text(moved)}</location>"
    sensors = sensor(calibration() + ("" if placed else pose)) + sensor(
        (pose if placed else "") + calibration(lens), 1
    ).replace("<sensor ", '<sensor master_id="0" ')
    inner = camera(first, 0)
    inner += f'<camera id="1" sensor_id="1" component_id="0" master_id="0" label="{second}"/>'
    # OFFSET is in units of the chunk, so that it is SCALE times as long in the world.
    centre = first.centre + SCALE * first.rotation.T @ OFFSET
    other = Known(second, ASIDE.T @ first.rotation, centre, lens)
    return document(sensors, inner), [first, other]


@pytest.mark.parametrize("placed", [0, 1])
def test_a_camera_of_a_rig_is_beside_its_master(tmp_path: Path, placed: int) -> None:
    """Whichever of both sensors the rig is measured from."""
    content, cameras = rig("right.JPG", placed)
    found = read_reconstruction(written(tmp_path, content))
    assert found.remarks == () and len(found.cameras) == 2
    for one, read in zip(cameras, found.cameras, strict=True):
        assert read.label == one.label and read.intrinsics is not None
        assert read.intrinsics.lens.fx == one.lens.fx
        np.testing.assert_allclose(read.camera_to_world[:3, :3], one.rotation.T, atol=1e-9)
        np.testing.assert_allclose(read.camera_to_world[:3, 3], one.centre, atol=1e-9)


def test_an_empty_place_in_a_rig_is_that_of_the_master(tmp_path: Path) -> None:
    """As Metashape 1.5 writes it for each sensor that is no part of a rig."""
    inner = calibration() + '<rotation fixed="true"/><location fixed="true"/>'
    path = written(tmp_path, document(sensor(inner), all_of(known())))
    assert worst(read_reconstruction(path), known()) < MOST


def test_what_has_no_label_is_no_photo(tmp_path: Path) -> None:
    inner = all_of(known()) + '<camera id="7" sensor_id="0"><orientation>1</orientation></camera>'
    found = read_reconstruction(written(tmp_path, document(sensor(calibration()), inner)))
    assert worst(found, known()) < MOST
    assert found.remarks == ("camera 'id 7': it has no label, as only what is no photo has",)


def test_cameras_of_a_rig_that_cannot_be_used_are_told(tmp_path: Path) -> None:
    content, cameras = rig("IMG_0000.JPG")
    found = read_reconstruction(written(tmp_path, content))
    assert worst(found, cameras[:1]) < MOST
    assert found.remarks == (
        "camera 'IMG_0000.JPG': its label is that of another camera in its rig: rename its photo",
    )
    lost = rig("b")[0].replace('<camera id="1"', '<camera id="2" label="m"/><camera id="1"')
    lost = lost.replace('master_id="0" label="b"', 'master_id="2" label="b"')
    found = read_reconstruction(written(tmp_path, lost))
    assert found.remarks == ("cameras 'm', 'b': it has no pose: Metashape did not align it",)
    nobody = lost.replace('master_id="2"', 'master_id="7"')
    with pytest.raises(ReconstructionError, match="camera 'b': there is no camera 7, its master; "):
        read_reconstruction(written(tmp_path, nobody))


def test_a_rolling_shutter_is_told(tmp_path: Path) -> None:
    remark = "sensor '0': it has a rolling shutter: what the camera's motion moves is left out"
    for value, remarks in (("true", (remark,)), ("false", ())):
        inner = f'<property name="rolling_shutter" value="{value}"/>' + calibration()
        found = read_reconstruction(written(tmp_path, document(sensor(inner), all_of(known()))))
        assert worst(found, known()) < MOST and found.remarks == remarks


def test_every_coefficient_is_read(tmp_path: Path) -> None:
    """Skew in pixels, and the coefficients of high order; the lens is no pinhole by any of them."""
    extra = "<b2>0.5</b2><k4>0.01</k4><p3>0.2</p3><p4>-0.1</p4>"
    path = written(tmp_path, document(sensor(calibration(extra=extra)), all_of(known())))
    found = read_reconstruction(path)
    assert found.remarks == ()
    lens = found.cameras[0].intrinsics.lens
    assert (lens.b2, lens.k4, lens.p3, lens.p4) == (0.5, 0.01, 0.2, -0.1)
    for name in ("b2", "k4", "p3", "p4"):
        assert LensDistortion(1.0, 1.0, 0.0, 0.0, **{name: 0.1}).distorts


def test_equal_remarks_of_many_sensors_are_one(tmp_path: Path) -> None:
    """A calibration for each photo, none of which is measured: one line names them."""
    cameras = known(7)
    plain = '<property name="focal_length" value="10"/><property name="pixel_width" value="0.02"/>'
    sensors = "".join(sensor(plain, number) for number in range(7))
    placed = "".join(camera(one, number, number) for number, one in enumerate(cameras))
    (remark,) = read_reconstruction(written(tmp_path, document(sensors, placed))).remarks
    assert remark.startswith("sensors '0', '1', '2', '3', '4' and 2 more: it has no calibration")


def test_what_is_no_frame_is_told(tmp_path: Path) -> None:
    cameras = known()
    fisheye = sensor(calibration().replace('type="frame"', 'type="fisheye"'), 1, "fisheye")
    inner = all_of(cameras) + camera(replace(cameras[0], label="wide"), 9, sensor_id=1)
    found = read_reconstruction(written(tmp_path, document(sensor(calibration()) + fisheye, inner)))
    assert worst(found, cameras) < MOST
    assert found.remarks == (
        "camera 'wide': its sensor is of type fisheye, which is no pinhole with a lens",
    )


def test_the_cure_is_for_what_all_cameras_lack(tmp_path: Path) -> None:
    whole = document(sensor(calibration()), all_of(known(2)))
    for lacking, cure in (
        (whole.replace('type="frame"', 'type="spherical"'), "undistort the photos"),
        (
            whole.replace("<transform>1", "<other>").replace("transform>", "other>"),
            "align the photos",
        ),
        (whole.replace("<camera ", '<camera enabled="0" '), "align the photos"),
    ):
        with pytest.raises(ReconstructionError, match=rf"cameras: none can be used \(.*\); {cure}"):
            read_reconstruction(written(tmp_path, lacking))


def test_the_region_goes_to_the_world(tmp_path: Path) -> None:
    region = "<region><center>1 2 3</center><size>2 4 6</size><R>1 0 0 0 1 0 0 0 1</R></region>"
    rest = f'<components><component id="0">{transform()}{region}</component></components>'
    path = written(tmp_path, document(sensor(calibration()), all_of(known()), rest))
    found = read_reconstruction(path).region
    assert found is not None
    corner = found @ (0.5, 0.5, 0.5, 1)
    np.testing.assert_allclose(corner[:3], SCALE * TURN @ (2, 4, 6) + MOVED, atol=1e-12)


def test_components_that_are_not_aligned_are_told(tmp_path: Path) -> None:
    rest = (
        f'<components><component id="0">{transform()}</component><component id="1"/></components>'
    )
    cameras = known()
    last = camera(cameras[-1], 9).replace('component_id="0"', 'component_id="1"')
    content = document(sensor(calibration()), all_of(cameras[:-1]) + last, rest)
    found = read_reconstruction(written(tmp_path, content))
    assert worst(replace(found, cameras=found.cameras[:-1]), cameras[:-1]) < MOST
    assert found.remarks[0].startswith("cameras are in 2 components that are not aligned")


def test_geographic_coordinates_are_told(tmp_path: Path) -> None:
    rest = transform() + '<reference>GEOGCS["WGS 84"]</reference>'
    path = written(tmp_path, document(sensor(calibration()), all_of(known()), rest))
    assert "geocentric" in read_reconstruction(path).remarks[0]


def test_ten_thousand_cameras_are_read(tmp_path: Path) -> None:
    one = known(1)[0]
    inner = "".join(camera(replace(one, label=f"c{number}"), number) for number in range(10_000))
    found = read_reconstruction(written(tmp_path, document(sensor(calibration()), inner)))
    assert len(found.cameras) == 10_000
    points = np.zeros((1, 3))
    assert np.abs(seen(found.cameras[-1], points) - seen(found.cameras[0], points)).max() < MOST


GOOD = document(sensor(calibration()), all_of(known(2)))


@pytest.mark.parametrize(
    ("old", "new", "element", "cause"),
    [
        ("<f>", "<g>", "XML", "no XML"),
        ("<f>518.25</f>", "", "sensor '0'", "no <f>"),
        ("<f>518.25</f>", "<fx>1</fx>", "sensor '0'", "PhotoScan 1.2"),
        ("<f>518.25</f>", "<f>nan</f>", "<f>", "no usable number"),
        ("<f>518.25</f>", "<f>-518.25</f>", "sensor '0'", "pixels"),
        ("<f>518.25</f>", "<f>1e999</f>", "<f>", "no usable number"),
        ('width="640"', 'width="0"', "<resolution>", "0 pixels"),
        ('width="640"', 'width="x"', "<resolution>", "'x' is no whole number"),
        (' width="640"', "", "<resolution>", "width"),
        (' id="0" label="lens"', ' id="7" label="lens"', "IMG_0000.JPG", "no sensor 0"),
        ('label="IMG_0001.JPG"', 'label="IMG_0000.JPG"', "IMG_0000.JPG", "twice"),
        ('label="IMG_0001.JPG"', 'label=""', "camera ''", "no label"),
        ('sensor_id="0" ', "", "IMG_0000.JPG", "sensor_id"),
        ('component_id="0"', 'component_id="5"', "IMG_0000.JPG", "no component 5"),
        ("<orientation>", "<orientation><deep>", "XML", "no XML"),
        ("<scale>0.31</scale>", "<scale>0</scale>", "<scale>", "not above 0"),
        ("<scale>0.31</scale>", "<scale>inf</scale>", "<scale>", "no usable number"),
        ("<cameras>", "<cameras/><other>", "XML", "no XML"),
    ],
)
def test_a_broken_file_is_refused(
    tmp_path: Path, old: str, new: str, element: str, cause: str
) -> None:
    assert old in GOOD
    path = written(tmp_path, GOOD.replace(old, new))
    with pytest.raises(ReconstructionError) as caught:
        read_reconstruction(path)
    error = caught.value
    assert str(error).startswith("cameras.xml: ") and "\n" not in str(error)
    assert element in error.element and cause in error.cause and error.cure


@pytest.mark.parametrize(
    "broken",
    ["1 2 3", "nan " + "0 " * 15, "1 0 0 0 0 1 0 0 0 0 -1 0 0 0 0 1",
     "2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 1",
     "1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 1", "1 0 0 x 0 1 0 0 0 0 1 0 0 0 0 1"],
)  # fmt: skip
def test_a_pose_that_is_none_is_refused(tmp_path: Path, broken: str) -> None:
    one = camera(known(1)[0], 0)
    start, end = one.index("<transform>") + 11, one.index("</transform>")
    path = written(tmp_path, document(sensor(calibration()), one[:start] + broken + one[end:]))
    with pytest.raises(ReconstructionError, match=r"camera 'IMG_0000.JPG', <transform>: .+; .+"):
        read_reconstruction(path)
