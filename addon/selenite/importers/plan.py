# SPDX-License-Identifier: GPL-3.0-or-later
"""From a file and what the user says of it to all that Blender gets: nothing is created here, so
that whatever is wrong, is wrong before anything exists."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..capture.photo_files import header, pixels, same_aspect
from ..capture.request import CaptureRequest
from ..problems import BadInput, Problem
from . import placement as places
from .agreement import remarks_on
from .lens import BlenderLens, blender_lens, distortion_of, intrinsics_of
from .pairing import Pairs, pair
from .photo_folder import short_name
from .placement import Placement
from .reconstruction import (
    Intrinsics,
    ReconstructedCamera,
    ReconstructedMesh,
    Reconstruction,
    ReconstructionError,
)

#: Gets the file, that of the cameras, and the folders of pictures.
Reader = Callable[[Path, Path | None, tuple[Path, ...]], Reconstruction]
#: Size of a camera that has neither calibration nor photo.
_USUAL_SIZE = (1920, 1080)
_BACKGROUND = (
    "no photo has a mask, so what is behind the mesh counts too: where the scene has no such "
    "background, give masks, or let the silhouette alone count"
)
#: What readers call a mesh that the file does not name.
_NAMELESS = ("", "mesh")


@dataclass(frozen=True)
class ImportRequest:
    """file: of the reconstruction. cameras: of its cameras, where they are not in it. photos,
    masks: folders. meters: in one unit of the file; None: as it says. known_distance: two points,
    each "X,Y,Z" in coordinates of the file or a camera's label, and the metres between them.
    ground: three such points whose plane becomes z = 0. up: "Z" or "Y", the file's upward axis.
    unit_length: metres in one Blender unit. silhouette: pixels off the rim of what a camera sees of
    the fitted objects, which alone counts then; of captures without a mask."""

    file: Path
    cameras: Path | None = None
    photos: Path | None = None
    masks: Path | None = None
    meters: float | None = None
    known_distance: tuple[str, str, float] | None = None
    ground: tuple[str, str, str] | None = None
    up: str = "Z"
    unit_length: float = 1.0
    silhouette: int | None = None


@dataclass(frozen=True)
class PlannedCamera:
    """name: of the object. matrix: 4 x 4 of Blender's world. capture: None without a photo.
    is_measured: whether the file has a calibration, or only an angle of view for its photo."""

    name: str
    label: str
    matrix: np.ndarray
    intrinsics: Intrinsics
    lens: BlenderLens
    capture: CaptureRequest | None
    is_measured: bool = True


@dataclass(frozen=True)
class ImportPlan:
    """All that Blender gets, in its world. warnings: what the user has to know, a line each.
    size: (3,) of the box around all meshes, or else points, in Blender units."""

    name: str
    source: Path
    placement: Placement
    cameras: tuple[PlannedCamera, ...]
    meshes: tuple[ReconstructedMesh, ...]
    points: np.ndarray
    region: np.ndarray | None
    clip: tuple[float, float]
    size: np.ndarray
    warnings: tuple[str, ...] = ()
    without_photo: tuple[str, ...] = ()
    without_camera: tuple[str, ...] = ()


def make_plan(
    request: ImportRequest, read: Reader, note: Callable[[str, float], None] = lambda *_: None
) -> ImportPlan:
    """Reads, places and pairs. read: gives what a file holds and raises ReconstructionError. note:
    gets what is done and how far. Raises BadInput with all that is wrong."""
    problems: list[Problem] = []
    note("reading", 0.0)
    found = _read(request, read)
    note("pairing photos", 0.4)
    warnings = [*found.remarks, *remarks_on(found)]
    source = request.cameras or request.file
    pairs = pair(found, source, request.photos, request.masks, problems)
    warnings += pairs.remarks
    if pairs.photos and found.meshes and not pairs.masks and request.silhouette is None:
        warnings.append(_BACKGROUND)
    scale = _scale(request, found, problems, warnings)
    ground = None
    if request.ground is not None:
        ground = _points(request.ground, found, "Ground", problems)
        if ground and (why := places.why_no_plane(ground)):
            cure = "give three points that are no line"
            problems.append(Problem("Ground", why, cure))
    if problems:
        raise BadInput(problems)
    placement = places.placement_of(found, scale, request.up, ground)
    if placement.offset.any():
        text = ", ".join(f"{value:.12g}" for value in placement.offset)
        warnings.append(f"the origin is moved to {text} of the file, which the collection keeps")
    note("measuring photos", 0.5)
    cameras = _cameras(found, placement, pairs, problems, note)
    if request.silhouette is not None:
        cameras = [_within(item, request.silhouette) for item in cameras]
    for mesh in found.meshes:
        _check_mesh(mesh, problems)
    if problems:
        raise BadInput(problems)
    meshes = _placed(found, placement)
    points = placement.points(found.points) if len(found.points) else found.points
    return ImportPlan(
        name=found.name,
        source=request.file,
        placement=placement,
        cameras=tuple(cameras),
        meshes=meshes,
        points=points,
        region=placement.box(found.region) if found.region is not None else None,
        clip=_clip(cameras, meshes, points),
        size=_size([mesh.positions for mesh in meshes] or [points]),
        warnings=tuple(warnings),
        without_photo=pairs.without,
        without_camera=pairs.left,
    )


def _read(request: ImportRequest, read: Reader) -> Reconstruction:
    folders = tuple(folder for folder in (request.photos, request.masks) if folder is not None)
    try:
        found = read(request.file, request.cameras, folders)
    except ReconstructionError as error:
        title = f"File '{Path(error.file).name}'"
        cause = f"{error.element}: {error.cause}"
        raise BadInput(Problem(title, cause, error.cure)) from error
    if not (found.cameras or found.meshes or len(found.points)):
        cause = "it holds neither cameras nor meshes nor points"
        cure = "give the file that the reconstruction was exported to"
        raise BadInput(Problem(f"File '{request.file.name}'", cause, cure))
    return found


def _scale(
    request: ImportRequest, found: Reconstruction, problems: list[Problem], warnings: list[str]
) -> float:
    """Blender units in one unit of the file."""
    scale, remark = places.unit_scale(found, request.meters, request.unit_length)
    if request.known_distance is None:
        warnings += [remark] if remark else []
        return scale
    first, second, length = request.known_distance
    ends = _points((first, second), found, "Scale", problems)
    meters = places.distance_scale(ends, length, problems) if ends else None
    return (meters or 1.0) / request.unit_length


def _points(
    texts: Sequence[str], found: Reconstruction, title: str, problems: list[Problem]
) -> list[np.ndarray] | None:
    """Each "X,Y,Z", or the place of a camera by label."""
    centres = {item.label: item.camera_to_world[:3, 3] for item in found.cameras}
    points = []
    for text in texts:
        if text in centres:
            points.append(np.asarray(centres[text], np.float64))
            continue
        try:
            point = np.array([float(part) for part in text.split(",")])
        except ValueError:
            point = np.zeros(0)
        if point.shape != (3,) or not np.isfinite(point).all():
            cause = f"'{text}' is neither a point nor the label of a camera"
            cure = "give X,Y,Z in coordinates of the file, or the label of a camera"
            problems.append(Problem(title, cause, cure))
        else:
            points.append(point)
    return points if len(points) == len(texts) else None


def _cameras(
    found: Reconstruction,
    placement: Placement,
    pairs: Pairs,
    problems: list[Problem],
    note: Callable[[str, float], None],
) -> list[PlannedCamera]:
    planned: list[PlannedCamera] = []
    taken: set[str] = set()
    for number, camera in enumerate(found.cameras):
        note(f"photo {number + 1} of {len(found.cameras)}", 0.5 + 0.3 * number / len(found.cameras))
        photo = pairs.photos.get(camera.label)
        size = _file_size(camera, photo, problems) if photo is not None else None
        intrinsics = intrinsics_of(camera, size or _USUAL_SIZE)
        lens = blender_lens(intrinsics)
        name = _free_name(short_name(camera.label), taken)
        capture = None
        if photo is not None:
            mask = pairs.masks.get(camera.label)
            capture = CaptureRequest(
                name,
                str(photo),
                mask=str(mask) if mask is not None else "",
                size=(intrinsics.width, intrinsics.height),
                distortion=distortion_of(intrinsics),
                pixel_aspect=lens.pixel_aspect,
            )
        matrix = placement.camera(camera.camera_to_world)
        known = camera.intrinsics is not None
        planned.append(PlannedCamera(name, camera.label, matrix, intrinsics, lens, capture, known))
    return planned


def _within(camera: PlannedCamera, silhouette: int) -> PlannedCamera:
    capture = camera.capture
    if capture is None or capture.mask:
        return camera
    return replace(camera, capture=replace(capture, silhouette=silhouette))


def _free_name(name: str, taken: set[str]) -> str:
    """A name of at most 59 bytes, Blender's limit less a number, that no other camera has."""
    short = name.encode()[:59].decode(errors="ignore") or "Camera"
    found, number = short, 1
    while found in taken:
        number += 1
        found = f"{short}-{number}"
    taken.add(found)
    return found


def _file_size(
    camera: ReconstructedCamera, photo: Path, problems: list[Problem]
) -> tuple[int, int] | None:
    """Of the photo, which has to have the shape of its calibration."""
    title = f"Photo '{photo}'"
    info = header(title, str(photo), problems, {}, as_linear=True)
    if info is None:
        return None
    size = (int(info["width"]), int(info["height"]))
    known = camera.intrinsics
    if known is not None and not same_aspect(size, (known.width, known.height)):
        cause = f"it is {pixels(size)}, the calibration is of {known.width} x {known.height}"
        if same_aspect(size, (known.height, known.width)):
            cause += f", which lies on its side; its Exif orientation is {info['orientation']}"
        cure = "give the photos that the reconstruction was made of, as they were"
        problems.append(Problem(title, cause, cure))
    return size


def _check_mesh(mesh: ReconstructedMesh, problems: list[Problem]) -> None:
    """A face that names a vertex which is not there would end Blender's process."""
    count = len(mesh.positions)
    good = not len(mesh.triangles) or (mesh.triangles.min() >= 0 and mesh.triangles.max() < count)
    if not (good and np.isfinite(mesh.positions).all()):
        cause = "a face names a vertex that is not there, or a vertex is not finite"
        problems.append(Problem(f"Mesh '{mesh.name}'", cause, "export the mesh again"))
    elif mesh.uvs is not None and not np.isfinite(mesh.uvs).all():
        cause = "a texture coordinate is not finite"
        problems.append(Problem(f"Mesh '{mesh.name}'", cause, "export the mesh again"))
    elif count == 0 or not len(mesh.triangles):
        cause = "it has no face"
        problems.append(Problem(f"Mesh '{mesh.name}'", cause, "export a mesh with faces"))


def _placed(found: Reconstruction, placement: Placement) -> tuple[ReconstructedMesh, ...]:
    """In Blender's world; a mesh without a name of its own gets the file's."""
    meshes, taken = [], set[str]()
    for mesh in found.meshes:
        normals = placement.directions(mesh.normals) if mesh.normals is not None else None
        own = mesh.name.strip()
        name = _free_name(found.name if own in _NAMELESS else own, taken)
        positions = placement.points(mesh.positions)
        meshes.append(replace(mesh, name=name, positions=positions, normals=normals))
    return tuple(meshes)


def _size(parts: Sequence[np.ndarray]) -> np.ndarray:
    """(3,) of the box around all."""
    points = np.concatenate([np.asarray(part).reshape(-1, 3) for part in parts])
    return points.max(axis=0) - points.min(axis=0) if len(points) else np.zeros(3)


def _clip(
    cameras: Sequence[PlannedCamera], meshes: Sequence[ReconstructedMesh], points: np.ndarray
) -> tuple[float, float]:
    """Distances at which cameras begin and end to see: around everything, whatever the unit."""
    parts = [item.matrix[None, :3, 3] for item in cameras]
    parts += [mesh.positions for mesh in meshes] or [points]
    diagonal = float(np.linalg.norm(_size(parts)))
    diagonal = diagonal if diagonal > 0 else 1.0
    return 1e-4 * diagonal, 100.0 * diagonal
