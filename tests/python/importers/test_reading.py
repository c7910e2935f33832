# SPDX-License-Identifier: GPL-3.0-or-later
"""What is read at all: files beside each other, hostile files, and a real capture."""

from __future__ import annotations

import gzip
import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from selenite.importers.read import read_reconstruction
from selenite.importers.readers import files
from selenite.importers.reconstruction import ReconstructionError

sys.path.insert(0, str(Path(__file__).parent))

from colmap_files import LENSES, write_text  # noqa: E402
from known import MOST, known, worst  # noqa: E402
from test_metashape import all_of, calibration, document, sensor  # noqa: E402
from test_x3d import COORDINATES, scene, shape  # noqa: E402

ROOT = Path(__file__).resolve().parents[3]
MESH = shape(f'<IndexedFaceSet coordIndex="0 1 2">{COORDINATES}</IndexedFaceSet>')


def metashape(folder: Path, cameras: list) -> Path:
    path = folder / "cameras.xml"
    path.write_text(document(sensor(calibration()), all_of(cameras)))
    return path


def test_the_mesh_of_one_file_and_the_cameras_of_another(tmp_path: Path) -> None:
    path = tmp_path / "mesh.x3d"
    path.write_text(scene(MESH + '<Viewpoint description="img_0000"/><Viewpoint description="V"/>'))
    found = read_reconstruction(path, metashape(tmp_path, known()))
    assert worst(found, known()) < MOST and len(found.meshes) == 1 and found.name == "mesh"
    assert found.remarks == ("Viewpoint 'V' is not among the cameras of cameras.xml",)


def test_cameras_in_other_coordinates_than_the_mesh_are_told(tmp_path: Path) -> None:
    path = tmp_path / "mesh.x3d"
    views = "".join(
        f'<Viewpoint description="{one.label}" position="{" ".join(map(str, one.centre + 1))}"/>'
        for one in known()
    )
    path.write_text(scene(MESH + views))
    (remark,) = read_reconstruction(path, metashape(tmp_path, known())).remarks
    assert "1.73 units apart" in remark


@pytest.mark.parametrize("name", ["scan.obj", "scan.GLTF", "scan.glb"])
def test_a_mesh_for_blenders_importers_is_named(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_bytes(b"anything")
    found = read_reconstruction(path, metashape(tmp_path, known()))
    assert found.mesh_files == (path,) and found.meshes == ()
    assert worst(found, known()) < MOST
    with pytest.raises(
        ReconstructionError, match="a mesh alone has no cameras; give the file with the cameras"
    ):
        read_reconstruction(path)


def test_a_mesh_with_the_cameras_of_a_colmap_folder(tmp_path: Path) -> None:
    cameras = known(lens=LENSES["OPENCV"])
    write_text(tmp_path / "model", cameras, "OPENCV")
    path = tmp_path / "scan.obj"
    path.write_bytes(b"anything")
    found = read_reconstruction(path, tmp_path / "model")
    assert worst(found, cameras) < MOST and len(found.points) == 1


BOMB = "".join(f'<!ENTITY e{n} "{f"&e{n - 1};" * 10}">' for n in range(1, 10))
DOCUMENTS = {
    "entity bomb": (f'<!DOCTYPE X3D [<!ENTITY e0 "ha">{BOMB}]><X3D>&e9;</X3D>', "DOCTYPE"),
    "doctype": ('<!DOCTYPE X3D PUBLIC "a" "http://example.org/x3d.dtd"><X3D/>', "DOCTYPE"),
    "external entity": ('<!DOCTYPE a [<!ENTITY b SYSTEM "file:///b">]><a>&b;</a>', "DOCTYPE"),
    "unknown root": ("<html/>", "<html> is of no known format"),
    "no scene": ("<X3D/>", "it has no <Scene>"),
    "no chunk": ("<document/>", "<document> is of no known format"),
    "no cameras": ("<document><chunk/></document>", "no chunk of it has <cameras>"),
    "deep": ("<X3D>" + "<Group>" * 5000 + "</Group>" * 5000 + "</X3D>", "nested deeper"),
    "broken": ("<X3D><Scene>", "no XML"),
    "undeclared entity": ("<X3D>&b;</X3D>", "no XML"),
    "encoding": ('<?xml version="1.0" encoding="cp037"?><X3D>\u00e9</X3D>', "it has no <Scene>"),
    "empty": ("", "its format is not known"),
    "classic": ("#VRML V2.0 utf8\n", "classic text"),
    "text": ("a,b,c\n1,2,3\n", "its format is not known"),
}  # fmt: skip


def test_text_in_utf_16_is_told(tmp_path: Path) -> None:
    path = tmp_path / "cameras.xml"
    path.write_bytes("<document/>".encode("utf-16"))
    with pytest.raises(ReconstructionError, match="it is text in UTF-16; save it as text in UTF-8"):
        read_reconstruction(path)


@pytest.mark.parametrize("kind", DOCUMENTS)
def test_a_document_that_is_none_is_refused(tmp_path: Path, kind: str) -> None:
    content, cause = DOCUMENTS[kind]
    path = tmp_path / "file.x3d"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(ReconstructionError) as caught:
        read_reconstruction(path)
    assert cause in caught.value.cause and caught.value.cure
    assert str(caught.value).startswith("file.x3d: ") and "\n" not in str(caught.value)
    assert list(tmp_path.iterdir()) == [path]


def test_what_is_not_there_is_refused(tmp_path: Path) -> None:
    for path in (tmp_path / "gone.xml", tmp_path / "a\0b", tmp_path / ("x" * 5000)):
        with pytest.raises(ReconstructionError) as caught:
            read_reconstruction(path)
        assert caught.value.cause == "it is not there, or no file"
    with pytest.raises(ReconstructionError, match="no reconstruction is in it"):
        read_reconstruction(tmp_path)
    os.mkfifo(tmp_path / "pipe.xml")
    with pytest.raises(ReconstructionError, match="no file"):
        read_reconstruction(tmp_path / "pipe.xml")


def test_a_folder_of_two_reconstructions_is_refused(tmp_path: Path) -> None:
    write_text(tmp_path, known(2, LENSES["PINHOLE"]), "PINHOLE")
    (tmp_path / "transforms.json").write_text("{}")
    with pytest.raises(ReconstructionError, match="a COLMAP model and transforms.json; give one"):
        read_reconstruction(tmp_path)


def test_a_folder_with_one_file_of_any_name_is_that_file(tmp_path: Path) -> None:
    """Two of them are refused, each by its name; files of other programs beside it do not count."""
    cameras = known(3)
    content = document(sensor(calibration()), all_of(cameras))
    (tmp_path / "garden.xml").write_text(content)
    (tmp_path / "trajectory.json").write_text('{"class_name": "PinholeCameraTrajectory"}')
    assert worst(read_reconstruction(tmp_path), cameras) < MOST
    (tmp_path / "later.xml").write_text(content)
    with pytest.raises(ReconstructionError, match=r"garden\.xml and later\.xml; give one of them"):
        read_reconstruction(tmp_path)


@pytest.mark.parametrize("name", ["cameras.txt", "images.txt"])
def test_lines_may_end_as_on_old_macintoshes(tmp_path: Path, name: str) -> None:
    cameras = known(2, LENSES["OPENCV"])
    write_text(tmp_path, cameras, "OPENCV")
    path = tmp_path / name
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r"))
    assert worst(read_reconstruction(tmp_path), cameras) < MOST


def test_compressed_files_have_a_limit_and_an_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    packed = gzip.compress(scene(MESH).encode())
    path = tmp_path / "scene.x3dz"
    garbled = packed[:30] + b"\xff" * 9 + packed[39:]
    for broken, cause in (
        (packed[:-9], "ends in the midst"),
        (packed[:20], "ends in the midst"),
        (garbled, "compression is broken"),
    ):
        path.write_bytes(broken)
        with pytest.raises(ReconstructionError, match=cause):
            read_reconstruction(path)
    path.write_bytes(gzip.compress(b" " * (files.MOST_TEXT + 1)))
    with pytest.raises(ReconstructionError, match="more than 256 MiB unpacked"):
        read_reconstruction(path)


LIMITED = """
import re, resource, sys
resource.setrlimit(resource.RLIMIT_AS, (3 << 30, 3 << 30))
from selenite.importers.read import read_reconstruction
from selenite.importers.reconstruction import ReconstructionError
try:
    read_reconstruction(sys.argv[1])
except ReconstructionError as error:
    print(error)
print(re.search(r"VmHWM:\\s+(\\d+)", open("/proc/self/status").read())[1])
"""
#: Files of up to 64 MB that would need much more than they have.
HUNGRY = {
    "tags.xml": lambda: "<a>" + "<b/>" * 10_000_000 + "</a>",
    "namespace.xml": lambda: (
        f'<a xmlns="{"n" * 1_000_000}">' + "".join(f"<b{n}/>" for n in range(5000)) + "</a>"
    ),
    "many.xml": lambda: (
        f'<a xmlns="{"n" * 199}">' + "".join(f"<b{n}/>" for n in range(999_990)) + "</a>"
    ),
    "attributes.xml": lambda: "<a " + " ".join(f'b{n}=""' for n in range(4_000_000)) + "/>",
    "numbers.x3d": lambda: scene(
        shape('<IndexedFaceSet coordIndex="0 1 2"><Coordinate point="'
              + "1 " * 27_000_000 + '"/></IndexedFaceSet>')
    ),
    "more.x3d": lambda: scene(
        2 * shape(f'<TriangleSet><Coordinate point="{"1 " * 15_300_000}"/></TriangleSet>')
    ),
    "lists.json": lambda: '{"frames": [' + "[]," * 20_000_000 + "[]]}",
    "numbers.ply": lambda: (
        "ply\nformat ascii 1.0\nelement vertex 9000000\nproperty float x\nproperty float y\n"
        "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
        + "1 " * 27_000_000 + "3 0 1 2"
    ),
    "lists.ply": lambda: (
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
        "property float z\nelement face 7000000\nproperty list uchar int vertex_indices\n"
        "end_header\n0 0 0 4 0 0 0 0 " + "3 0 0 0 " * 6_999_999
    ),
    "names.json": lambda: "{" + ",".join(f'"{n}":""' for n in range(4_000_000)) + "}",
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", HUNGRY)
def test_a_hungry_file_needs_less_than_a_gibibyte(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_text(HUNGRY[name]())
    command = [sys.executable, "-c", LIMITED, str(path)]
    environment = os.environ | {"PYTHONPATH": str(ROOT / "addon")}
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
    *_, kilobytes = done.stdout.split()
    assert int(kilobytes) < 1 << 20, done.stdout


def _shared(name: str) -> Path:
    folder = os.environ.get("SELENITE_SHARED_DIR")
    path = Path(folder or "shared") / "data" / name
    if not path.exists():
        pytest.skip(f"{name} is not there: SELENITE_SHARED_DIR names no folder with it")
    return path


def test_a_real_capture_is_read_to_a_hundredth_of_a_pixel() -> None:
    """A head of Buddha: 13 photos, a mesh, a chunk that is turned, moved and scaled."""
    folder = _shared("buddha_head")
    truth = json.loads((folder / "cameras.json").read_text())
    found = read_reconstruction(folder / "buddha.x3d", folder / "cameras.xml")
    (mesh,) = found.meshes
    assert mesh.positions.shape == (10010, 3) and mesh.triangles.shape == (20000, 3)
    assert (
        mesh.uvs is not None and mesh.materials[0].texture == (folder / "buddha_tex.jpg").resolve()
    )
    assert [remark for remark in found.remarks if "not_aligned" not in remark] == []
    poses = {
        Path(frame["file"]).stem: np.array(frame["camera_to_world"]) for frame in truth["frames"]
    }
    assert sorted(camera.label for camera in found.cameras) == sorted(poses)
    for camera in found.cameras:
        assert camera.intrinsics is not None
        lens = camera.intrinsics.lens
        pixels = []
        for matrix, (fx, fy, cx, cy) in (
            (camera.camera_to_world, (lens.fx, lens.fy, lens.cx, lens.cy)),
            (poses[camera.label], [truth[name] for name in ("fx", "fy", "cx", "cy")]),
        ):
            x, y, z = matrix[:3, :3].T @ (mesh.positions - matrix[:3, 3]).T
            pixels.append(np.stack([fx * x / z + cx, fy * y / z + cy])[:, z > 0.01])
        assert np.abs(pixels[0] - pixels[1]).max() < 0.01
    alone = read_reconstruction(folder / "buddha.x3d")
    assert len(alone.cameras) == 13
    for camera in alone.cameras:
        np.testing.assert_allclose(camera.camera_to_world, poses[camera.label], atol=1e-7)
        angle = 2 * np.arctan(truth["height"] / 2 / truth["fy"])
        assert camera.field_of_view == pytest.approx(angle, abs=1e-6)


def test_labels_match_with_folders_and_suffixes_or_without(tmp_path: Path) -> None:
    cameras = [replace(one, label=f"/photos/{one.label}") for one in known()]
    path = tmp_path / "mesh.x3d"
    views = "".join(f'<Viewpoint description="IMG_{number:04d}"/>' for number in range(5))
    path.write_text(scene(MESH + views))
    found = read_reconstruction(path, metashape(tmp_path, cameras))
    assert worst(found, cameras) < MOST
    assert not [remark for remark in found.remarks if "not among" in remark]
