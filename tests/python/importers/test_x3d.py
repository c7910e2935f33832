# SPDX-License-Identifier: GPL-3.0-or-later
"""X3D scenes: meshes, pictures of them and Viewpoints."""

from __future__ import annotations

import gzip
import math
import sys
from html import escape
from pathlib import Path

import numpy as np
import pytest

from selenite.importers.read import read_reconstruction
from selenite.importers.reconstruction import Reconstruction, ReconstructionError

sys.path.insert(0, str(Path(__file__).parent))

from known import FLIP, HEIGHT, POINTS, WIDTH, Known, Lens, known, picture, quaternion, text  # noqa: E402

HALF = math.pi / 2
VIEW = '<Viewpoint description="A" position="0 0 3"/>'
#: Two triangles and a square.
COORDINATES = '<Coordinate point="0 0 0, 1 0 0, 1 1 0, 0 1 0, 0 0 1, 1 0 1"/>'
FACES = '<IndexedFaceSet coordIndex="0 1 2 3 -1 0 1 4 -1 4 1 5">' + COORDINATES


def scene(inner: str, head: str = "") -> str:
    return f'<X3D version="3.3"><head>{head}</head><Scene>{inner}</Scene></X3D>'


def shape(geometry: str, appearance: str = "") -> str:
    return f"<Shape><Appearance>{appearance}</Appearance>{geometry}</Shape>"


def read(folder: Path, inner: str, head: str = "") -> Reconstruction:
    path = folder / "scene.x3d"
    path.write_text(scene(inner, head), encoding="utf-8")
    return read_reconstruction(path)


def turn(axis: tuple[float, float, float], angle: float) -> np.ndarray:
    """3 x 3, by Rodrigues' formula."""
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross


def viewpoint(one: Known, angle: float) -> str:
    w, *axis = quaternion((FLIP @ one.rotation).T)
    length = float(np.linalg.norm(axis))
    orientation = text(np.array([*(np.array(axis) / length), 2 * math.atan2(length, w)]))
    return (
        f'<Viewpoint description="{one.label}" position="{text(one.centre)}"'
        f' orientation="{orientation}" fieldOfView="{angle!r}"/>'
    )


def test_viewpoints_are_cameras_with_the_smaller_angle(tmp_path: Path) -> None:
    lens = Lens(480.0, 480.0)
    cameras = known(lens=lens)
    angle = 2 * math.atan(min(WIDTH, HEIGHT) / 2 / lens.fx)
    found = read(tmp_path, "".join(viewpoint(one, angle) for one in cameras))
    assert [camera.label for camera in found.cameras] == [one.label for one in cameras]
    for camera, one in zip(found.cameras, cameras, strict=True):
        assert camera.intrinsics is None and camera.field_of_view is not None
        matrix = camera.camera_to_world
        x, y, z = matrix[:3, :3].T @ (POINTS - matrix[:3, 3]).T
        focal = min(WIDTH, HEIGHT) / 2 / math.tan(camera.field_of_view / 2)
        u, v, w = one.rotation @ (POINTS - one.centre).T
        assert np.abs(focal * x / z - lens.fx * u / w).max() < 1e-6
        assert np.abs(focal * y / z - lens.fx * v / w).max() < 1e-6


def test_a_viewpoint_without_description_has_its_name_or_number(tmp_path: Path) -> None:
    found = read(tmp_path, '<Viewpoint DEF="B" position="1 2 3"/><Viewpoint/>')
    assert [camera.label for camera in found.cameras] == ["B", "Viewpoint 2"]
    assert found.cameras[1].field_of_view == pytest.approx(math.pi / 4)
    np.testing.assert_array_equal(found.cameras[1].camera_to_world[:3, 3], (0, 0, 10))


def test_transforms_nest_around_viewpoints_and_meshes(tmp_path: Path) -> None:
    outer = (
        f'<Transform translation="1 2 3" rotation="0 0 2 {HALF!r}" center="1 0 0" scale="2 2 2">'
    )
    inner = '<Group><Transform rotation="1 1 0 0.4">'
    found = read(
        tmp_path,
        f"{outer}{inner}{VIEW}{shape(FACES + '</IndexedFaceSet>')}</Transform></Group></Transform>",
    )
    around = turn((0, 0, 1), HALF)
    within = turn((1, 1, 0), 0.4)
    centre = np.array([1.0, 0.0, 0.0])

    def placed(point: np.ndarray) -> np.ndarray:
        return around @ (2 * (within @ point - centre)) + centre + (1, 2, 3)

    (mesh,) = found.meshes
    np.testing.assert_allclose(mesh.positions[5], placed(np.array([1.0, 0, 1])), atol=1e-12)
    matrix = found.cameras[0].camera_to_world
    np.testing.assert_allclose(matrix[:3, 3], placed(np.array([0.0, 0, 3])), atol=1e-12)
    np.testing.assert_allclose(matrix[:3, :3], around @ within @ FLIP, atol=1e-12)


def test_faces_become_triangles_with_their_places_in_the_picture(tmp_path: Path) -> None:
    uvs = '<TextureCoordinate point="0 0 1 0 1 1 0 1 .5 .5 .25 .25"/>'
    found = read(tmp_path, shape(FACES + uvs + "</IndexedFaceSet>"))
    (mesh,) = found.meshes
    assert mesh.triangles.tolist() == [[0, 1, 2], [0, 2, 3], [0, 1, 4], [4, 1, 5]]
    assert mesh.uvs is not None and mesh.normals is None and mesh.colors is None
    assert mesh.uvs[2].tolist() == [[0, 0], [1, 0], [0.5, 0.5]]


def test_pictures_and_normals_may_have_lists_of_their_own(tmp_path: Path) -> None:
    geometry = FACES.replace(
        "<IndexedFaceSet",
        '<IndexedFaceSet texCoordIndex="1 0 1 0 -1 0 0 0 -1 1 1 1 -1" normalPerVertex="false"'
        ' normalIndex="1 0 1"',
    )
    geometry += (
        '<TextureCoordinate point="0 0 1 1"/><Normal vector="0 0 1 1 0 0"/></IndexedFaceSet>'
    )
    (mesh,) = read(tmp_path, shape(geometry)).meshes
    assert mesh.uvs is not None and mesh.normals is not None
    assert mesh.uvs[1].tolist() == [[1, 1], [1, 1], [0, 0]]
    assert mesh.normals[:, 0].tolist() == [[1, 0, 0], [1, 0, 0], [0, 0, 1], [1, 0, 0]]


def test_a_clockwise_face_and_a_mirror_are_turned_over(tmp_path: Path) -> None:
    one = '<IndexedFaceSet ccw="false" coordIndex="0 1 2">' + COORDINATES + "</IndexedFaceSet>"
    mirrored = f'<Transform scale="-1 1 1">{shape(FACES + "</IndexedFaceSet>")}</Transform>'
    first, second = read(tmp_path, shape(one) + mirrored).meshes
    assert first.triangles.tolist() == [[2, 1, 0]]
    a, b, c = second.positions[second.triangles[0]]
    assert np.cross(b - a, c - a)[2] > 0


def test_sets_of_triangles_are_read(tmp_path: Path) -> None:
    indexed = f'<IndexedTriangleSet index="0 1 2 1 2 3">{COORDINATES}</IndexedTriangleSet>'
    plain = f"<TriangleSet>{COORDINATES}</TriangleSet>"
    first, second = read(tmp_path, shape(indexed) + shape(plain)).meshes
    assert first.triangles.tolist() == [[0, 1, 2], [1, 2, 3]]
    assert second.triangles.tolist() == [[0, 1, 2], [3, 4, 5]]


def test_colours_of_vertices_are_linear(tmp_path: Path) -> None:
    colours = '<Color color="1 0 0 0.5 0.5 0.5 0 0 0 1 1 1 0 0 0 0 0 1"/></IndexedFaceSet>'
    (mesh,) = read(tmp_path, shape(FACES + colours)).meshes
    assert mesh.colors is not None
    # 0.5 of sRGB is 0.21404 in linear light.
    np.testing.assert_allclose(mesh.colors[:2], [[1, 0, 0], [0.21404] * 3], atol=1e-5)


def test_what_is_defined_can_be_used_again(tmp_path: Path) -> None:
    first = f'<Shape DEF="S"><Appearance DEF="look"/>{FACES}</IndexedFaceSet></Shape>'
    found = read(tmp_path, first + '<Transform translation="5 0 0"><Shape USE="S"/></Transform>')
    assert [mesh.name for mesh in found.meshes] == ["S", "S 2"]
    np.testing.assert_allclose(
        found.meshes[1].positions, found.meshes[0].positions + (5, 0, 0), atol=1e-15
    )


def test_shapes_with_the_same_coordinates_are_one_mesh(tmp_path: Path) -> None:
    """As Blender and others write a mesh of several materials."""
    for name in ("a.png", "b.png"):
        picture(tmp_path / name)
    shared = COORDINATES.replace("<Coordinate", '<Coordinate DEF="c"')
    uvs = '<TextureCoordinate point="0 0 1 0 1 1 0 1 .5 .5 .25 .25"/>'
    parts = (
        ('<Appearance DEF="skin"><ImageTexture url="a.png"/></Appearance>', "0 1 2 -1",
         shared + uvs),
        ('<Appearance><ImageTexture url="b.png"/></Appearance>', "0 2 3 -1",
         '<Coordinate USE="c"/>' + uvs),
        ("<Appearance/>", "0 1 4 -1 4 1 5 -1", '<Coordinate USE="c"/>'),
        ('<Appearance USE="skin"/>', "0 4 5 -1", '<Coordinate USE="c"/>' + uvs),
    )  # fmt: skip
    content = "".join(
        f'<Shape>{appearance}<IndexedFaceSet coordIndex="{index}">{inner}</IndexedFaceSet></Shape>'
        for appearance, index, inner in parts
    )
    apart = f'<Transform translation="5 0 0"><Group DEF="g">{content}</Group></Transform>'
    found = read(tmp_path, apart + '<Group USE="g"/>')
    assert len(found.meshes) == 2
    for mesh in found.meshes:
        assert mesh.triangles.tolist() == [[0, 1, 2], [0, 2, 3], [0, 1, 4], [4, 1, 5], [0, 4, 5]]
        assert [(one.name, one.texture and one.texture.name) for one in mesh.materials] == [
            ("skin", "a.png"), ("", "b.png"), ("", None)]  # fmt: skip
        assert mesh.material_of is not None and mesh.material_of.tolist() == [0, 1, 2, 2, 0]
        assert mesh.uvs is not None
        assert mesh.uvs[1].tolist() == [[0, 0], [1, 1], [0, 1]] and not mesh.uvs[2:4].any()
    assert found.meshes[0].positions[0, 0] == found.meshes[1].positions[0, 0] + 5


@pytest.mark.parametrize(
    "url",
    ["a b.png", '"a b.png"', "'a b.png'", '"gone.png" "a b.png"', '"gone.png","a b.png"',
     "a%20b.png",
     '"http://example.org/a.png" "a b.png"', "./a b.png", '"/somewhere/else.png" "a b.png"',
     '"a\\ b.png"', "sub/../a b.png", '"..\\sub\\gone.png" "a b.png"'],
)  # fmt: skip
def test_a_picture_is_found_in_whatever_quotes(tmp_path: Path, url: str) -> None:
    picture(tmp_path / "a b.png")
    image = f'<ImageTexture url="{escape(url, quote=True)}"/>'
    (mesh,) = read(tmp_path, shape(FACES + "</IndexedFaceSet>", image)).meshes
    assert mesh.materials[0].texture == tmp_path.resolve() / "a b.png"


def test_a_picture_that_is_not_there_is_told(tmp_path: Path) -> None:
    image = '<ImageTexture url="gone.png"/>'
    found = read(tmp_path, shape(FACES + "</IndexedFaceSet>", image))
    assert not found.meshes[0].textured
    assert found.remarks == ("the texture 'gone.png' is not there: its faces are white",)


@pytest.mark.parametrize(
    "url",
    ["../secret.png", "/etc/passwd", '"http://example.org/a.png"', "file:///etc/passwd",
     "C:\\a.png", "link.png", "\\\\server\\a.png", "%2e%2e/secret.png", "sub/../../secret.png"],
)  # fmt: skip
def test_a_picture_elsewhere_is_refused(tmp_path: Path, url: str) -> None:
    picture(tmp_path / "secret.png")
    folder = tmp_path / "folder"
    folder.mkdir()
    (folder / "link.png").symlink_to(tmp_path / "secret.png")
    image = f'<ImageTexture url="{escape(url, quote=True)}"/>'
    with pytest.raises(ReconstructionError, match=r"scene.x3d: ImageTexture, url: .*below the fo"):
        read(folder, shape(FACES + "</IndexedFaceSet>", image))


def test_a_compressed_scene_is_read(tmp_path: Path) -> None:
    for name in ("scene.x3dz", "scene.x3d.gz"):
        path = tmp_path / name
        path.write_bytes(gzip.compress(scene(VIEW).encode()))
        found = read_reconstruction(path)
        assert found.name == "scene" and found.cameras[0].label == "A"


def test_the_unit_of_length_is_read(tmp_path: Path) -> None:
    unit = '<unit category="length" name="mm" conversionFactor="0.001"/>'
    assert read(tmp_path, VIEW, unit).meters_per_unit == 0.001
    assert read(tmp_path, VIEW).meters_per_unit is None


def test_nodes_that_are_not_read_are_named(tmp_path: Path) -> None:
    rest = '<Inline url="other.x3d"/>' + shape("<Sphere/>")
    assert read(tmp_path, VIEW + rest).remarks == ("not read: Inline, Sphere",)


def test_what_is_only_declared_is_not_seen(tmp_path: Path) -> None:
    hidden = '<ProtoDeclare><ProtoBody><Viewpoint description="no"/></ProtoBody></ProtoDeclare>'
    found = read(tmp_path, f"{hidden}<Unknown>{VIEW}</Unknown>")
    assert [camera.label for camera in found.cameras] == ["A"]


def test_a_switch_shows_what_it_chooses(tmp_path: Path) -> None:
    views = '<Viewpoint description="A"/><Viewpoint description="B"/>'
    found = read(tmp_path, f'<Switch whichChoice="1">{views}</Switch><Switch>{views}</Switch>')
    assert [camera.label for camera in found.cameras] == ["B"]


@pytest.mark.parametrize(
    ("inner", "element", "cause"),
    [
        ("", "Scene", "neither a mesh nor a Viewpoint"),
        (shape("<Sphere/>"), "Scene", "neither a mesh nor a Viewpoint"),
        (VIEW + VIEW, "Viewpoint 'A'", "twice"),
        ('<Viewpoint position="0 0"/>', "Viewpoint, position", "2 numbers instead of 3"),
        ('<Viewpoint position="0 0 nan"/>', "Viewpoint, position", "no usable number"),
        ('<Viewpoint position="0 0 z"/>', "Viewpoint, position", "are no numbers"),
        ('<Viewpoint orientation="0 0 0 1"/>', "orientation", "axis is 0 0 0"),
        ('<Viewpoint fieldOfView="3.2"/>', "fieldOfView", "not between"),
        ('<Viewpoint fieldOfView="0"/>', "fieldOfView", "not between"),
        (f'<Transform scale="1 2 1">{VIEW}</Transform>', "Viewpoint 'A'", "a Transform around it"),
        (f'<Transform scale="-1 1 1">{VIEW}</Transform>', "Viewpoint 'A'", "a Transform around"),
        (f'<Transform scale="1 0 1">{VIEW}</Transform>', "Transform, scale", "a side of it is 0"),
        ('<Shape USE="none"/>', "Shape", "no Shape has the DEF 'none'"),
        ('<Group DEF="G"><Group USE="G"/></Group>', "Group 'G'", "used inside itself"),
        ('<Group DEF="G"/><Group DEF="G"/>', "Group 'G'", "twice"),
        (shape('<IndexedFaceSet coordIndex="0 1 2"/>'), "IndexedFaceSet", "no Coordinate"),
        (shape('<IndexedFaceSet coordIndex="0 1 9">' + COORDINATES + "</IndexedFaceSet>"),
         "coordIndex", "index 9 is outside of the 6 entries"),
        (shape('<IndexedFaceSet coordIndex="0 1 -1">' + COORDINATES + "</IndexedFaceSet>"),
         "coordIndex", "2 corners"),
        (shape('<IndexedFaceSet coordIndex="0 1 1.5">' + COORDINATES + "</IndexedFaceSet>"),
         "coordIndex", "not all of them are whole"),
        (shape('<IndexedFaceSet coordIndex="0 1 2" ccw="yes">' + COORDINATES + "</IndexedFaceSet>"),
         "ccw", "'yes' is not true or false"),
        (shape('<IndexedTriangleSet index="0 1">' + COORDINATES + "</IndexedTriangleSet>"),
         "index", "not a multiple of 3"),
        (shape(FACES.replace("0 0 0, 1", "0 0, 1") + "</IndexedFaceSet>"),
         "Coordinate, point", "not a multiple of 3"),
        (shape(FACES + '<TextureCoordinate point="0 0"/></IndexedFaceSet>'),
         "texCoordIndex", "outside of the 1 entries"),
        (shape(FACES.replace("<IndexedFaceSet", '<IndexedFaceSet texCoordIndex="0 1 2"')
               + '<TextureCoordinate point="0 0 1 0 1 1"/></IndexedFaceSet>'),
         "texCoordIndex", "not those of coordIndex"),
        (shape(FACES + '<Color color="2 0 0"/></IndexedFaceSet>'), "Color, color", "0 to 1"),
        (shape(FACES + "</IndexedFaceSet>", "<ImageTexture url='\"a.png'/>"),
         "ImageTexture, url", "quotes"),
    ],
)  # fmt: skip
def test_a_broken_scene_is_refused(tmp_path: Path, inner: str, element: str, cause: str) -> None:
    with pytest.raises(ReconstructionError) as caught:
        read(tmp_path, inner)
    error = caught.value
    assert str(error).startswith("scene.x3d: ") and "\n" not in str(error)
    assert element in error.element and cause in error.cause and error.cure


def test_uses_that_multiply_are_refused(tmp_path: Path) -> None:
    """Twenty groups, each of the one before it ten times."""
    inner = f'<Group DEF="g0">{VIEW}</Group>'
    for level in range(1, 20):
        uses = f'<Group USE="g{level - 1}"/>' * 10
        inner += f'<Group DEF="g{level}">{uses}</Group>'
    with pytest.raises(ReconstructionError, match=r"twice|500000 nodes"):
        read(tmp_path, inner)
    with pytest.raises(ReconstructionError, match=r"500000 nodes"):
        read(tmp_path, inner.replace(VIEW, "<Group/>"))
