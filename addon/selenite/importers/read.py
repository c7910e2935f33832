# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads a reconstruction in any format that is known, by name and content; creates nothing."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from fnmatch import fnmatch
from pathlib import Path, PurePosixPath

import numpy as np

from ..paths import is_folder
from .readers import bundler, foreign, metashape, nerf, ply, realitycapture, x3d
from .readers.colmap import model_folder as colmap
from .readers.files import GZIP, MOST_BINARY, Place, shortened, size_of
from .readers.xml_tree import read_tree
from .reconstruction import ReconstructedCamera, Reconstruction, ReconstructionError

#: Meshes without cameras; PLY has a reader here, the others are left to Blender's importers.
PLY, GLTF = ".ply", (".glb", ".gltf")
TRANSFORMS = "transforms.json"
MESHES = (PLY, ".obj", *GLTF)
KNOWN = (
    "Metashape's cameras as XML, X3D, a COLMAP folder, transforms.json, XMP files and CSV of"
    " RealityCapture, bundle.out, or a mesh as OBJ, PLY or glTF with such cameras"
)


def read_reconstruction(
    file: Path | str | Sequence[Path | str],
    cameras: Path | str | None = None,
    pictures: Iterable[Path | str] = (),
) -> Reconstruction:
    """What a file or folder holds; with `cameras`, those of another file instead of its own.

    file: of Metashape (XML), X3D, COLMAP (a folder or one of its files), NeRF (transforms.json),
    RealityCapture (CSV; XMP files: one, several or their folder), Bundler; or a mesh as PLY, OBJ or
    glTF, which needs `cameras`. One as OBJ or glTF is named in `mesh_files`.
    pictures: folders with photos or masks, for formats that leave out the photos' size.
    Raises ReconstructionError.
    """
    folders = tuple(Path(folder) for folder in pictures)
    files = [Path(file)] if isinstance(file, Path | str) else [Path(one) for one in file]
    if not files:
        raise ReconstructionError("", "files", "there are none", "give one at least")
    # Numbers of a file may be of any size: what comes of them is looked at, not warned of.
    with np.errstate(all="ignore"):
        if len(files) > 1:
            found = realitycapture.read_xmp(files, files[0].resolve().parent.name, folders)
        elif files[0].suffix.lower() in MESHES:
            found = _of_mesh(files[0], cameras)
        else:
            found = _read(files[0], folders)
        if cameras is not None:
            found = _with_cameras(found, _read(Path(cameras), folders), Path(cameras))
    return _checked(found, files[0])


def _of_mesh(file: Path, cameras: Path | str | None) -> Reconstruction:
    size_of(file, 1 << 40)
    if cameras is None:
        raise Place(file, "file").error(
            "a mesh alone has no cameras", "give the file with the cameras too"
        )
    if file.suffix.lower() == PLY:
        mesh, remarks = ply.read_ply(file)
        return Reconstruction(file.stem, meshes=(mesh,), remarks=remarks)
    return Reconstruction(file.stem, mesh_files=(file,))


def _read(file: Path, pictures: tuple[Path, ...]) -> Reconstruction:
    if is_folder(file):
        return _of_folder(file, pictures)
    if _is_part_of_colmap(file):
        return colmap.read_colmap(file.parent, file.parent.name)
    start = _start(file)
    if start.startswith(b"#VRML") or start.startswith(b"#X3D"):
        raise Place(file, "file").error("it is VRML or X3D in classic text", "export it as .x3d")
    other = foreign.error_of(file, start)
    if other is not None:
        raise other
    if start.startswith(bundler.HEADER):
        return bundler.read_bundler(file, pictures)
    if start.startswith(b"{"):
        return nerf.read_nerf(file, pictures)
    if start.startswith((b"<", GZIP)):
        return _of_xml(file, pictures)
    is_table = realitycapture.csv_header(start.decode("utf-8", errors="replace")) is not None
    if is_table or file.suffix.lower() == ".csv":
        return realitycapture.read_csv(file, pictures)
    if start.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise Place(file, "file").error("it is text in UTF-16", "save it as text in UTF-8")
    raise Place(file, "file").error("its format is not known", f"give {KNOWN}")


def _start(file: Path) -> bytes:
    """Of a file, without white space and byte order mark before it."""
    size_of(file, MOST_BINARY)
    try:
        with file.open("rb") as stream:
            return stream.read(1 << 16).lstrip(b"\xef\xbb\xbf \t\r\n")
    except OSError as error:
        raise Place(file, "file").unreadable(error) from error


def _of_xml(file: Path, pictures: tuple[Path, ...]) -> Reconstruction:
    root = read_tree(file)
    if metashape.is_metashape(root):
        return metashape.read_metashape(root, file)
    if x3d.is_x3d(root):
        return x3d.read_x3d(root, file)
    if realitycapture.is_xmp(root):
        return realitycapture.read_xmp([file], file.stem, pictures)
    cause = f"its root <{shortened(root.tag)}> is of no known format"
    raise Place(file, "XML").error(cause, f"give {KNOWN}")


def _of_folder(folder: Path, pictures: tuple[Path, ...]) -> Reconstruction:
    """What a folder holds. Raises ReconstructionError where that is not one thing."""
    name = folder.resolve().name
    model = colmap.model_folder(folder)
    try:
        entries = sorted(folder.iterdir())
    except OSError as error:
        raise Place(folder, "folder").unreadable(error) from error
    sidecars = [path for path in entries if path.suffix.lower() == ".xmp"]
    single = [path for path in entries if path.name in (TRANSFORMS, "bundle.out")]
    # Of data sets that are parted into those of training, of test and others.
    parted = [path for path in entries if fnmatch(path.name, "transforms_*.json")]
    single += parted if folder / TRANSFORMS not in single else []
    if model is None and not sidecars:
        known = (*single, *parted)
        single += [path for path in entries if path not in known and _is_reconstruction(path)]
    kinds = [*(["a COLMAP model"] if model else []), *(["XMP files"] if sidecars else [])]
    kinds += [path.name for path in single]
    if len(kinds) > 1:
        raise Place(folder, "folder").error(f"it holds {' and '.join(kinds)}", "give one of them")
    if model is not None:
        return colmap.read_colmap(model, name)
    if sidecars:
        return realitycapture.read_xmp(sidecars, name, pictures)
    if single:
        return replace(_read(single[0], pictures), name=name)
    raise foreign.error_of_folder(folder, entries) or Place(folder, "folder").error(
        "no reconstruction is in it", f"give {KNOWN}"
    )


def _is_reconstruction(file: Path) -> bool:
    """Whether a file with a name of its own holds cameras of a kind that is read."""
    if file.suffix.lower() not in (".xml", ".x3d", ".csv", ".out", ".json"):
        return False
    try:
        start = _start(file)
    except ReconstructionError:
        return False
    if foreign.error_of(file, start) is not None:
        return False
    is_table = realitycapture.csv_header(start.decode("utf-8", errors="replace")) is not None
    is_xml = (b"<document" in start and b"<chunk" in start) or b"<X3D" in start
    is_nerf = start.startswith(b"{") and b'"frames"' in start and b'"transform_matrix"' in start
    return is_table or is_xml or is_nerf or start.startswith(bundler.HEADER)


def _is_part_of_colmap(file: Path) -> bool:
    names = ("cameras", "images", "points3D", "rigs", "frames")
    return file.name in {f"{name}{suffix}" for name in names for suffix in (".bin", ".txt")}


def _with_cameras(mesh: Reconstruction, other: Reconstruction, file: Path) -> Reconstruction:
    """The mesh of one file and the cameras of another. Viewpoints that are not among these are
    named."""
    if not other.cameras:
        raise Place(file, "file").error("it has no cameras", "export the cameras alone")
    known = {_key(camera.label) for camera in other.cameras}
    lost = [camera.label for camera in mesh.cameras if _key(camera.label) not in known]
    remarks = [f"Viewpoint '{label}' is not among the cameras of {file.name}" for label in lost]
    apart = _apart(mesh.cameras, other.cameras)
    if apart:
        remarks.append(apart)
    return replace(
        mesh,
        cameras=other.cameras,
        points=other.points if len(other.points) else mesh.points,
        meters_per_unit=mesh.meters_per_unit or other.meters_per_unit,
        remarks=(*mesh.remarks, *other.remarks, *remarks),
        region=other.region,
    )


def _key(label: str) -> str:
    """A photo's label without folder and suffix, as programs write it either way."""
    name = PurePosixPath(label.replace("\\", "/")).name
    return (name.rpartition(".")[0] or name).casefold()


def _apart(
    own: tuple[ReconstructedCamera, ...], other: tuple[ReconstructedCamera, ...]
) -> str | None:
    """Whether cameras of both files that have the same label stand at different places."""
    there = {_key(camera.label): camera.camera_to_world[:3, 3] for camera in other}
    pairs = [
        (camera.camera_to_world[:3, 3], there[_key(camera.label)])
        for camera in own
        if _key(camera.label) in there
    ]
    if len(pairs) < 2:
        return None
    first, second = (np.array(side) for side in zip(*pairs, strict=True))
    extent = np.linalg.norm(second - second.mean(axis=0), axis=1).max()
    distance = float(np.median(np.linalg.norm(first - second, axis=1)))
    if distance <= 0.01 * extent:
        return None
    return (
        f"Viewpoints and cameras of the same label are {distance:.3g} units apart: mesh and cameras"
        " are in different coordinates"
    )


def _checked(found: Reconstruction, file: Path) -> Reconstruction:
    """Each remark once. Raises ReconstructionError for a pose that is not finite after all."""
    for camera in found.cameras:
        if not np.isfinite(camera.camera_to_world).all():
            raise Place(file, f"camera '{camera.label}'").error("its pose is not finite")
    return replace(found, remarks=tuple(dict.fromkeys(found.remarks)))
