# SPDX-License-Identifier: GPL-3.0-or-later
"""PLY meshes in text and both binary orders, written byte by byte."""

from __future__ import annotations

import struct
import sys
from pathlib import Path

import numpy as np
import pytest

from selenite.importers.read import read_reconstruction
from selenite.importers.reconstruction import ReconstructedMesh, Reconstruction, ReconstructionError

sys.path.insert(0, str(Path(__file__).parent))

from colmap_files import LENSES, write_text  # noqa: E402
from known import known, picture  # noqa: E402

FORMS = ("ascii", "binary_little_endian", "binary_big_endian")
LETTERS = {"float": "f", "double": "d", "uchar": "B", "int": "i", "uint": "I", "ushort": "H"}
#: A square in four corners and a triangle; numbers that single precision has.
PLACES = [(0, 0, 0), (1, 0, 0), (1, 1, 0.5), (0, 1, 0.5), (0.5, 0.25, -1)]
FACES = [(0, 1, 2, 3), (4, 1, 0)]
TRIANGLES = [(0, 1, 2), (0, 2, 3), (4, 1, 0)]


def element(form: str, name: str, properties: list[str], rows: list[list]) -> tuple[str, bytes]:
    """Header and body. properties: "float x" or "list uchar int name", whose values are a tuple."""
    head = f"element {name} {len(rows)}\n" + "".join(f"property {text}\n" for text in properties)
    order = ">" if form == "binary_big_endian" else "<"
    body = b""
    for row in rows:
        for text, value in zip(properties, row, strict=True):
            words = text.split()
            values, letters = [value], LETTERS[words[-2]]
            if words[0] == "list":
                values, letters = [len(value), *value], LETTERS[words[1]] + len(value) * letters
            if form == "ascii":
                body += " ".join(repr(number) for number in values).encode() + b" "
            else:
                body += struct.pack(order + letters, *values)
        body += b"\n" if form == "ascii" else b""
    return head, body


def write(path: Path, form: str, *parts: tuple[str, bytes], comment: str = "") -> Path:
    head = f"ply\nformat {form} 1.0\n{comment}" + "".join(head for head, _ in parts)
    path.write_bytes(head.encode() + b"end_header\n" + b"".join(body for _, body in parts))
    return path


def vertices(form: str, places: list = PLACES, kind: str = "float") -> tuple[str, bytes]:
    properties = [f"{kind} {axis}" for axis in "xyz"]
    return element(form, "vertex", properties, [list(place) for place in places])


def faces(form: str, listed: list = FACES) -> tuple[str, bytes]:
    rows = [[corners] for corners in listed]
    return element(form, "face", ["list uchar int vertex_indices"], rows)


def read(path: Path) -> tuple[ReconstructedMesh, Reconstruction]:
    if not (path.parent / "model").exists():
        write_text(path.parent / "model", known(2, LENSES["PINHOLE"]), "PINHOLE")
    found = read_reconstruction(path, path.parent / "model")
    (mesh,) = found.meshes
    return mesh, found


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("listed", [FACES, TRIANGLES], ids=["mixed", "triangles"])
def test_places_and_faces(tmp_path: Path, form: str, listed: list) -> None:
    mesh, found = read(write(tmp_path / "scan.PLY", form, vertices(form), faces(form, listed)))
    np.testing.assert_array_equal(mesh.positions, PLACES)
    np.testing.assert_array_equal(mesh.triangles, TRIANGLES)
    assert mesh.uvs is None and mesh.normals is None and mesh.colors is None
    assert mesh.name == "scan" and found.remarks == () and len(found.cameras) == 2


@pytest.mark.parametrize("form", FORMS)
def test_doubles_keep_their_digits_a_million_metres_away(tmp_path: Path, form: str) -> None:
    places = [(1e6 + x / 3, 2e6 + y / 3, z / 3) for x, y, z in PLACES]
    mesh, _ = read(
        write(tmp_path / "scan.ply", form, vertices(form, places, "double"), faces(form))
    )
    np.testing.assert_array_equal(mesh.positions, places)


@pytest.mark.parametrize("form", FORMS)
def test_normals_colours_and_other_elements(tmp_path: Path, form: str) -> None:
    names = ["float x", "float y", "float z", "float nx", "float ny", "float nz"]
    names += ["uchar red", "uchar green", "uchar blue", "uchar alpha", "float quality"]
    rows = [[*place, 0.0, 3.0, 4.0, 255, 188, 0, 7, 0.5] for place in PLACES]
    path = write(
        tmp_path / "scan.ply", form,
        element(form, "camera", ["list uchar float k", "int w"], [[(1.5, 2.5), 9], [(), 8]]),
        element(form, "vertex", names, rows), faces(form),
    )  # fmt: skip
    mesh, _ = read(path)
    np.testing.assert_array_equal(mesh.positions, PLACES)
    assert mesh.normals is not None and mesh.colors is not None
    np.testing.assert_allclose(mesh.normals, np.broadcast_to((0, 0.6, 0.8), (3, 3, 3)), atol=1e-15)
    # Code value 188 of sRGB is half of the light.
    np.testing.assert_allclose(mesh.colors, np.broadcast_to((1, 0.5029, 0), (5, 3)), atol=1e-4)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("at", ["corners", "vertices"])
def test_a_texture_at_the_corners_or_at_the_vertices(tmp_path: Path, form: str, at: str) -> None:
    picture(tmp_path / "skin 1.png")
    uvs = [(x / 2, y / 4) for x, y, _ in PLACES]
    if at == "vertices":
        names = ["float x", "float y", "float z", "float s", "float t"]
        rows = [[*place, *uv] for place, uv in zip(PLACES, uvs, strict=True)]
        points = element(form, "vertex", names, rows)
        shapes = faces(form)
    else:
        points = vertices(form)
        rows = [[corners, tuple(number for one in corners for number in uvs[one]), 0]
                for corners in FACES]  # fmt: skip
        properties = ["list uchar uint vertex_index", "list uchar float texcoord", "int texnumber"]
        shapes = element(form, "face", properties, rows)
    comment = "comment made by hand\ncomment TextureFile skin 1.png\n"
    mesh, found = read(write(tmp_path / "scan.ply", form, points, shapes, comment=comment))
    np.testing.assert_array_equal(mesh.triangles, TRIANGLES)
    np.testing.assert_array_equal(mesh.uvs, np.array(uvs)[np.array(TRIANGLES)])
    assert mesh.materials[0].texture == tmp_path / "skin 1.png" and found.remarks == ()


def test_a_texture_that_is_not_there_and_a_second_one_are_told(tmp_path: Path) -> None:
    rows = [[corners, (0.0, 0.0) * len(corners)] for corners in FACES]
    properties = ["list uchar int vertex_indices", "list uchar float texcoord"]
    shapes = element("ascii", "face", properties, rows)
    comment = "comment TextureFile a.png\ncomment TextureFile b.png\n"
    path = write(tmp_path / "scan.ply", "ascii", vertices("ascii"), shapes, comment=comment)
    mesh, found = read(path)
    assert not mesh.textured and mesh.uvs is not None
    assert found.remarks == (
        "of its 2 textures only the first is used, as no texnumber says which face has which",
        "the texture 'a.png' is not there: its faces are white",
    )


@pytest.mark.parametrize("form", FORMS)
def test_each_face_has_the_texture_of_its_number(tmp_path: Path, form: str) -> None:
    """-1, as MeshLab writes it, is none."""
    for name in ("a.png", "b.png"):
        picture(tmp_path / name)
    comment = "comment TextureFile a.png\ncomment TextureFile b.png\n"
    properties = ["list uchar int vertex_indices", "list uchar float texcoord", "int texnumber"]
    for numbers, of_faces, count in (((1, 0), [1, 1, 0], 2), ((-1, 1), [2, 2, 1], 3)):
        rows = [[corners, (0.0, 0.0) * len(corners), number]
                for corners, number in zip(FACES, numbers, strict=True)]  # fmt: skip
        shapes = element(form, "face", properties, rows)
        path = write(tmp_path / "scan.ply", form, vertices(form), shapes, comment=comment)
        mesh, found = read(path)
        assert found.remarks == () and mesh.material_of is not None
        assert mesh.material_of.tolist() == of_faces
        textures = [material.texture for material in mesh.materials]
        assert textures == [tmp_path / "a.png", tmp_path / "b.png", None][:count]


def test_a_face_may_be_without_texture(tmp_path: Path) -> None:
    rows = [[FACES[0], tuple(n / 8 for n in range(8))], [FACES[1], ()]]
    properties = ["list uchar int vertex_indices", "list uchar float texcoord"]
    shapes = element("binary_little_endian", "face", properties, rows)
    form = "binary_little_endian"
    mesh, _ = read(write(tmp_path / "scan.ply", form, vertices(form), shapes))
    assert mesh.uvs is not None
    np.testing.assert_array_equal(mesh.uvs[1], [(0, 0.125), (0.5, 0.625), (0.75, 0.875)])
    assert not mesh.uvs[2].any()


def test_windows_ends_its_lines_in_two_letters(tmp_path: Path) -> None:
    path = write(tmp_path / "scan.ply", "ascii", vertices("ascii"), faces("ascii"))
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    np.testing.assert_array_equal(read(path)[0].positions, PLACES)


GOOD = "".join(head for head, _ in (vertices("ascii"), faces("ascii")))
BODY = b"".join(body for _, body in (vertices("ascii"), faces("ascii"))).decode()
WHOLE = f"ply\nformat ascii 1.0\n{GOOD}end_header\n{BODY}"


@pytest.mark.parametrize(
    ("old", "new", "element_", "cause"),
    [
        ("ply", "plx", "header", "no PLY"),
        ("end_header", "end", "header", "no PLY"),
        ("ascii", "text", "header", "its format is not one of"),
        ("property float x", "property half x", "header", "is no element or property"),
        ("property float x", "property list float float x", "header", "is no element or property"),
        ("element vertex 5\n", "", "header", "is no element or property"),
        ("element vertex 5", "element vertex x", "header", "no whole number"),
        ("element vertex 5", "element vertex 99999999999", "header", "it has 99999999999"),
        ("element vertex 5", "element vertex 2000", "vertex", "before the last of its 2000 rows"),
        ("element face", "element vertex", "header", "comes twice"),
        ("element face 2", "element empty 1\nelement face 2", "header", "no property"),
        ("property float x", "property float a", "vertex", "no x, y and z"),
        ("element vertex 5", "element vertex 0", "face", "there is none"),
        ("vertex_indices", "strips", "face", "there is none"),
        ("element face 2", "element face 0", "face", "there is none"),
        ("4 0 1 2 3", "4 0 1 2 5", "face", "index 5 is outside"),
        ("4 0 1 2 3", "4 0 1 2 -1", "face", "index -1 is outside"),
        ("4 0 1 2 3", "4 0 1 2 0.5", "face", "not all of them are whole"),
        ("4 0 1 2 3", "2 0 1 ", "face", "a face has 2 corners"),
        ("4 0 1 2 3", "-4 0 1 2 3", "face", "a list of it has -4 entries"),
        ("4 0 1 2 3", "400 0 1 2 3", "face", "before the last of its 2 rows"),
        ("0.25", "nan", "numbers", "no usable number"),
        ("0.25", "x", "numbers", "are no numbers"),
        ("0.25", "\xe9", "numbers", "are no text"),
    ],
)
def test_a_broken_file_is_refused(
    tmp_path: Path, old: str, new: str, element_: str, cause: str
) -> None:
    assert old in WHOLE
    path = tmp_path / "scan.ply"
    path.write_text(WHOLE.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ReconstructionError) as caught:
        read(path)
    error = caught.value
    assert str(error).startswith("scan.ply: ") and "\n" not in str(error)
    assert element_ in error.element and cause in error.cause and error.cure


def test_a_place_that_is_none_and_a_wild_texture_are_refused(tmp_path: Path) -> None:
    form = "binary_little_endian"
    places = [*PLACES[:4], (float("inf"), 0, 0)]
    with pytest.raises(ReconstructionError, match="vertex: inf is no usable number; "):
        read(write(tmp_path / "a.ply", form, vertices(form, places), faces(form)))
    names = ["float x", "list uchar float y", "float z"]
    points = element(form, "vertex", names, [[x, (y, y), z] for x, y, z in PLACES])
    with pytest.raises(ReconstructionError, match="vertex: x, y, z are lists; "):
        read(write(tmp_path / "e.ply", form, points, faces(form)))
    with pytest.raises(ReconstructionError, match="face: index 0 is outside of the 0 entries"):
        read(write(tmp_path / "f.ply", form, vertices(form, []), faces(form)))
    rows = [[corners, (0.0, 0.0) * 3] for corners in FACES]
    properties = ["list uchar int vertex_indices", "list uchar float texcoord"]
    shapes = element(form, "face", properties, rows)
    with pytest.raises(ReconstructionError, match="texcoord are not two numbers for each corner"):
        read(write(tmp_path / "b.ply", form, vertices(form), shapes))
    names = ["float x", "float y", "float z", "float red", "float green", "float blue"]
    points = element(form, "vertex", names, [[*place, 0.0, 1.5, 0.0] for place in PLACES])
    with pytest.raises(ReconstructionError, match="green and blue: 1.5 is not from 0 to 1"):
        read(write(tmp_path / "c.ply", form, points, faces(form)))
    rows = [[corners, (0.0, 0.0) * len(corners)] for corners in FACES]
    shapes = element(form, "face", properties, rows)
    outside = "comment TextureFile ../skin.png\n"
    with pytest.raises(ReconstructionError, match="not a picture below the folder of the file"):
        read(write(tmp_path / "d.ply", form, vertices(form), shapes, comment=outside))


@pytest.mark.parametrize("listed", [FACES, TRIANGLES], ids=["mixed", "triangles"])
def test_a_binary_file_that_ends_too_early_is_refused(tmp_path: Path, listed: list) -> None:
    form = "binary_big_endian"
    path = write(tmp_path / "scan.ply", form, vertices(form), faces(form, listed))
    whole = path.read_bytes()
    for length in range(len(whole)):
        path.write_bytes(whole[:length])
        with pytest.raises(ReconstructionError, match=r"it is no PLY|it ends before the last"):
            read(path)
