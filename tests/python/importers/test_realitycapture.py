# SPDX-License-Identifier: GPL-3.0-or-later
"""XMP files and CSV of RealityCapture."""

from __future__ import annotations

import math
import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from selenite.importers.read import read_reconstruction
from selenite.importers.reconstruction import ReconstructionError

sys.path.insert(0, str(Path(__file__).parent))

from known import FLIP, FULL, HEIGHT, MOST, WIDTH, Known, known, picture, text, worst  # noqa: E402

#: RealityCapture has one focal length and a ratio of sides.
CAMERAS = known()


def xmp(one: Known, model: str = "brown3t2", extra: str = "", pose: bool = True) -> str:
    lens = one.lens
    coefficients = text(np.array([lens.k1, lens.k2, lens.k3, 0, lens.p2, lens.p1]))
    where = (
        f"<xcr:Rotation>{text(one.rotation)}</xcr:Rotation>"
        f"<xcr:Position>{text(one.centre)}</xcr:Position>"
    )
    return (
        '<x:xmpmeta xmlns:x="adobe:ns:meta/">'
        '<rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">'
        '<rdf:Description xcr:Version="3" xcr:PosePrior="exact" xcr:Coordinates="absolute"'
        f' xcr:DistortionModel="{model}" xcr:FocalLength35mm="{lens.fx * 36 / WIDTH!r}"'
        f' xcr:AspectRatio="{lens.fy / lens.fx!r}" xcr:Skew="0"'
        f' xcr:PrincipalPointU="{(lens.cx - WIDTH / 2) / WIDTH!r}"'
        f' xcr:PrincipalPointV="{(lens.cy - HEIGHT / 2) / WIDTH!r}" {extra}'
        ' xmlns:xcr="http://www.capturingreality.com/ns/xcr/1.1#">'
        f"{where if pose else ''}"
        f"<xcr:DistortionCoeficients>{coefficients}</xcr:DistortionCoeficients>"
        "</rdf:Description></rdf:RDF></x:xmpmeta>"
    )


def named(cameras: list[Known]) -> list[Known]:
    """As an XMP file is: without the photo's suffix."""
    return [replace(one, label=one.label.removesuffix(".JPG")) for one in cameras]


def write_xmp(folder: Path, cameras: list[Known]) -> None:
    for one in cameras:
        picture(folder / f"{one.label}.JPG")
        (folder / f"{one.label}.xmp").write_text(xmp(one))


def test_reprojection_from_a_folder_of_xmp_files(tmp_path: Path) -> None:
    write_xmp(tmp_path, named(CAMERAS))
    found = read_reconstruction(tmp_path)
    assert worst(found, named(CAMERAS)) < MOST and found.remarks == ()
    assert found.cameras[0].photo == "IMG_0000.JPG"
    one = read_reconstruction(tmp_path / "IMG_0002.xmp")
    assert worst(one, named(CAMERAS)[2:3]) < MOST
    several = [tmp_path / "IMG_0001.xmp", tmp_path / "IMG_0003.xmp"]
    assert worst(read_reconstruction(several), named(CAMERAS)[1:4:2]) < MOST


FIELDS = ("DistortionModel", "FocalLength35mm", "AspectRatio", "Skew", "PrincipalPointU")
INNER = ("Rotation", "Position", "DistortionCoeficients")


def test_attributes_and_elements_mean_the_same(tmp_path: Path) -> None:
    one = named(CAMERAS)[0]
    content = xmp(one)
    elements, attributes = content, content
    for name in FIELDS:
        ((found, value),) = re.findall(f'( xcr:{name}="([^"]*)")', content)
        elements = elements.replace(found, "")
        inner = f"<xcr:{name}>{value}</xcr:{name}>"
        elements = elements.replace("<xcr:Rotation>", f"{inner}<xcr:Rotation>")
    for name in INNER:
        ((found, value),) = re.findall(f"(<xcr:{name}>([^<]*)</xcr:{name}>)", content)
        attributes = attributes.replace(found, "").replace(
            " xcr:Skew", f' xcr:{name}="{value}" xcr:Skew'
        )
    unnamed = content.replace(' xcr:DistortionModel="brown3t2"', "")
    packet = f'<?xpacket begin="\ufeff" id="W5"?>\n{content}\n<?xpacket end="w"?>'
    picture(tmp_path / f"{one.label}.JPG")
    path = tmp_path / f"{one.label}.xmp"
    for text_ in (elements, attributes, unnamed, packet):
        assert text_ != content
        path.write_text(text_)
        assert worst(read_reconstruction(path), [one]) < MOST


def test_photos_may_lie_in_another_folder(tmp_path: Path) -> None:
    write_xmp(tmp_path / "photos", named(CAMERAS))
    (tmp_path / "xmp").mkdir()
    for path in (tmp_path / "photos").glob("*.xmp"):
        path.rename(tmp_path / "xmp" / path.name)
    found = read_reconstruction(tmp_path / "xmp", pictures=[tmp_path / "photos"])
    assert worst(found, named(CAMERAS)) < MOST
    with pytest.raises(ReconstructionError, match=r"IMG_0000.xmp: .*give their folder"):
        read_reconstruction(tmp_path / "xmp")


def test_a_photo_may_be_of_high_range(tmp_path: Path) -> None:
    one = named(CAMERAS)[0]
    head = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {HEIGHT} +X {WIDTH}\n"
    content = head.encode() + bytes((128, 128, 128, 129)) * (WIDTH * HEIGHT)
    (tmp_path / f"{one.label}.hdr").write_bytes(content)
    (tmp_path / f"{one.label}.xmp").write_text(xmp(one))
    assert worst(read_reconstruction(tmp_path), [one]) < MOST


def test_portrait_photos_have_their_longer_side_as_the_film(tmp_path: Path) -> None:
    cameras = named(CAMERAS[:1])
    picture(tmp_path / "IMG_0000.JPG", HEIGHT, WIDTH)
    (tmp_path / "IMG_0000.xmp").write_text(xmp(cameras[0]))
    found = read_reconstruction(tmp_path).cameras[0].intrinsics
    assert found is not None and (found.width, found.height) == (HEIGHT, WIDTH)
    lens = found.lens
    assert lens.fx == pytest.approx(FULL.fx, abs=MOST)
    assert lens.cx == pytest.approx(HEIGHT / 2 + FULL.cx - WIDTH / 2, abs=MOST)


def test_cameras_without_pose_and_other_models_are_told(tmp_path: Path) -> None:
    cameras = named(CAMERAS)
    write_xmp(tmp_path, cameras[:3])
    (tmp_path / "IMG_0003.xmp").write_text(xmp(cameras[3], pose=False))
    (tmp_path / "IMG_0004.xmp").write_text(xmp(cameras[4], "division"))
    found = read_reconstruction(tmp_path)
    assert worst(found, cameras[:3]) < MOST
    assert found.remarks == (
        "camera 'IMG_0003': it has no pose: RealityCapture did not align it",
        "camera 'IMG_0004': its model division is not Brown's",
    )


def test_the_cure_of_other_models_is_one_of_browns(tmp_path: Path) -> None:
    picture(tmp_path / "IMG_0000.JPG")
    (tmp_path / "IMG_0000.xmp").write_text(xmp(CAMERAS[0], "division"))
    with pytest.raises(ReconstructionError, match=r"division is not Brown's\); choose .+Brown3"):
        read_reconstruction(tmp_path)
    (tmp_path / "IMG_0000.xmp").write_text(xmp(CAMERAS[0], pose=False))
    with pytest.raises(ReconstructionError, match="did not align it\\); align the photos"):
        read_reconstruction(tmp_path)


@pytest.mark.parametrize("model", ["brown3", "Brown4", "brown3t2", "brown4t2"])
@pytest.mark.parametrize("count", [3, 4, 6])
def test_every_model_of_browns_is_read(tmp_path: Path, model: str, count: int) -> None:
    """With the coefficients that it has, or zeros after them."""
    lens = FULL if count == 6 else replace(FULL, p1=0.0, p2=0.0)
    cameras = [replace(one, lens=lens) for one in named(CAMERAS)]
    for one in cameras:
        picture(tmp_path / f"{one.label}.JPG")
        listed = [lens.k1, lens.k2, lens.k3, 0, lens.p2, lens.p1]
        content = xmp(one, model).replace(text(np.array(listed)), text(np.array(listed[:count])))
        (tmp_path / f"{one.label}.xmp").write_text(content)
    found = read_reconstruction(tmp_path)
    assert worst(found, cameras) < MOST and found.remarks == ()


def test_skew_is_read(tmp_path: Path) -> None:
    picture(tmp_path / "IMG_0000.JPG")
    content = xmp(CAMERAS[0]).replace('Skew="0"', 'Skew="0.1"')
    (tmp_path / "IMG_0000.xmp").write_text(content)
    found = read_reconstruction(tmp_path)
    # 0.1 of 36 mm, on 640 pixels.
    assert found.remarks == ()
    assert found.cameras[0].intrinsics.lens.b2 == pytest.approx(0.1 * 640 / 36)


@pytest.mark.parametrize(
    ("old", "new", "element", "cause"),
    [
        ("xcr:FocalLength35mm", "xcr:Other", "Description", "no FocalLength35mm"),
        ('Skew="0"', 'Skew="x"', "Skew", "no numbers"),
        ("<xcr:Rotation>", "<xcr:Rotation>1 ", "Rotation", "10 numbers instead of 9"),
        ("<xcr:Position>", "<xcr:Position>nan ", "Position", "4 numbers instead of 3"),
        (
            "<xcr:DistortionCoeficients>",
            "<xcr:DistortionCoeficients>1 ",
            "Coeficients",
            "7 numbers",
        ),
        ('AspectRatio="', 'AspectRatio="-', "Description", "fy is -"),
    ],
)
def test_a_broken_xmp_file_is_refused(
    tmp_path: Path, old: str, new: str, element: str, cause: str
) -> None:
    picture(tmp_path / "IMG_0000.JPG")
    content = xmp(CAMERAS[0])
    assert old in content
    (tmp_path / "IMG_0000.xmp").write_text(content.replace(old, new).replace("</xcr:Other", "</x"))
    with pytest.raises(ReconstructionError) as caught:
        read_reconstruction(tmp_path)
    assert element in caught.value.element and cause in caught.value.cause and caught.value.cure


#: Degrees, as RealityCapture turns a camera that looks down with its top to the north.
HEADING, PITCH, ROLL = 130.0, 62.0, -11.0
COLUMNS = "#name,x,y,alt,heading,pitch,roll,f,px,py,k1,k2,k3,k4,t1,t2"


def turned(degrees: float, axis: int) -> np.ndarray:
    """3 x 3 by the exponential of a cross product, as a series."""
    cross = np.zeros((3, 3))
    first, second = (axis + 1) % 3, (axis + 2) % 3
    cross[first, second], cross[second, first] = -math.radians(degrees), math.radians(degrees)
    total, term = np.eye(3), np.eye(3)
    for order in range(1, 40):
        term = term @ cross / order
        total = total + term
    return total


def csv_camera() -> Known:
    to_world = turned(-HEADING, 2) @ turned(PITCH, 0) @ turned(ROLL, 1)
    centre = -(to_world @ (0, 0, -4.0))  # the points are around the origin
    lens = replace(FULL, fy=FULL.fx)
    return Known("IMG_0001.jpg", FLIP @ to_world.T, centre, lens)


def row(one: Known) -> str:
    lens = one.lens
    values = [
        *one.centre, HEADING, PITCH, ROLL, lens.fx * 36 / WIDTH, (lens.cx - WIDTH / 2) / WIDTH,
        (lens.cy - HEIGHT / 2) / WIDTH, lens.k1, lens.k2, lens.k3, 0, lens.p2, lens.p1,
    ]  # fmt: skip
    return ",".join([one.label, *(repr(float(value)) for value in values)])


@pytest.mark.parametrize(
    "head",
    [
        COLUMNS,
        "#cameras 1\n" + COLUMNS,
        COLUMNS[1:],
        COLUMNS.replace("heading", "yaw").replace("px,py", "px_norm,py_norm"),
        ",".join(f'"{name}"' for name in COLUMNS.split(",")),
    ],
)
@pytest.mark.parametrize("separator", [",", ";", "\t", ", "])
def test_reprojection_from_csv(tmp_path: Path, head: str, separator: str) -> None:
    picture(tmp_path / "IMG_0001.jpg")
    path = tmp_path / "cameras.csv"
    path.write_text(f"{head}\n{row(csv_camera())}\n".replace(",", separator))
    found = read_reconstruction(path)
    assert worst(found, [csv_camera()]) < MOST and found.cameras[0].photo == "IMG_0001.jpg"
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r"))
    assert worst(read_reconstruction(path), [csv_camera()]) < MOST


def test_a_camera_of_csv_looks_down_and_north_is_up(tmp_path: Path) -> None:
    picture(tmp_path / "a.jpg")
    path = tmp_path / "cameras.csv"
    path.write_text(
        "#name,x,y,alt,heading,pitch,roll,f\na.jpg,1,2,3,0,0,0,36\na2.jpg,0,0,0,90,0,0,36"
    )
    picture(tmp_path / "a2.jpg")
    down, east = read_reconstruction(path).cameras
    np.testing.assert_allclose(down.camera_to_world[:3, 2], (0, 0, -1), atol=1e-15)
    np.testing.assert_allclose(down.camera_to_world[:3, 1], (0, -1, 0), atol=1e-15)
    # A heading of 90 degrees is east: the top of the photo points there.
    np.testing.assert_allclose(east.camera_to_world[:3, 1], (-1, 0, 0), atol=1e-15)


@pytest.mark.parametrize(
    ("content", "element", "cause"),
    [
        (f"{COLUMNS}\n", "CSV", "no camera can be used"),
        ("#name,x,y,z,omega,phi,kappa\na.jpg,1,2,3,4,5,6\n", "header", "columns are not those"),
        (
            f"{COLUMNS}\n{row(csv_camera())}\n".replace(",", ";").replace(".", ","),
            "row 2",
            "are no numbers",
        ),
        (f"{COLUMNS},{COLUMNS}\n{row(csv_camera())}\n", "row 2", "16 columns instead of 32"),
        (f"{COLUMNS}\na,1,2\n", "row 2", "3 columns instead of 16"),
        (f"{COLUMNS}\n{row(csv_camera())}\n{row(csv_camera())}\n", "IMG_0001.jpg", "twice"),
        (
            f"{COLUMNS}\n{row(csv_camera()).replace('130.0', 'nan')}\n",
            "heading",
            "no usable number",
        ),
        (f"{COLUMNS}\n{row(csv_camera()).replace('130.0', 'x')}\n", "heading", "no numbers"),
        (f"{COLUMNS}\n{row(csv_camera()).replace('IMG', 'GONE')}\n", "GONE", "size of its photo"),
    ],
)
def test_a_broken_csv_is_refused(tmp_path: Path, content: str, element: str, cause: str) -> None:
    picture(tmp_path / "IMG_0001.jpg")
    path = tmp_path / "cameras.csv"
    path.write_text(content)
    with pytest.raises(ReconstructionError) as caught:
        read_reconstruction(path)
    assert element in caught.value.element and cause in caught.value.cause and caught.value.cure
