# SPDX-License-Identifier: GPL-3.0-or-later
"""A pebble with known material, photographed by Cycles with lenses that distort, and what four
programs would write of its reconstruction. From Blender primitives only (CC0). Run it inside bpy:

    python scenes/reconstruction.py --out pebble            photos and reconstructions (a minute)
    python scenes/reconstruction.py --out pebble --fit      imports each, fits, compares (minutes)
"""

import argparse
import json
import math
import sys
from dataclasses import dataclass
from pathlib import Path

import bpy
import mathutils
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
import reconstruction_files as files  # noqa: E402
from example_scene import principled, set_comparison  # noqa: E402
from reconstruction_files import Camera, Lens, Mesh  # noqa: E402

MATERIAL = "Pebble"
TRUTH = {"base_color": (0.62, 0.33, 0.16), "roughness": 0.35}
SIZE = (192, 144)
#: Moves the corners of the photo by 8 to 13 pixels; a principal point off the centre, pixels that
#: are no squares.
LENS = Lens(*SIZE, 220.0, 222.2, 99.0, 69.5, k1=-0.25, k2=0.05, p1=0.002, p2=-0.003)
#: Where cameras stand: azimuth and height in degrees, distance in metres.
PLACES = ((20, 15, 0.16), (110, 35, 0.17), (200, 5, 0.155), (290, 60, 0.165))
#: Strength of the even white world; an import stands one of strength 1 in, from which fits start.
SKY = 0.7
_FINER = 2  # pixels of the render, along each side, in one of the photo
_PARTS = 6  # along each side of a photo's pixel, of which it is the mean
_MARGIN = 1.5  # field of view of the render over that of the lens


@dataclass(frozen=True)
class Reconstruction:
    """Of the scene: its cameras, mesh, and the photos that were written."""

    cameras: list[Camera]
    mesh: Mesh
    photos: list[Path]


def build(offset: tuple = (0.0, 0.0, 0.0), *, replaces: bool = True) -> Reconstruction:
    """Replaces the open file by the pebble under an even white sky, or adds it. offset: added to
    all of the reconstruction in double precision, as a national grid does; the scene stays at the
    origin."""
    if replaces:
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    pebble = _add_pebble()
    world = scene.world = bpy.data.worlds.new("World")
    world.use_nodes = True
    background = next(n for n in world.node_tree.nodes if n.bl_idname == "ShaderNodeBackground")
    background.inputs["Color"].default_value = (1, 1, 1, 1)
    background.inputs["Strength"].default_value = SKY
    cameras = [
        Camera(f"IMG_{number:04}", _pose(*place), LENS) for number, place in enumerate(PLACES, 1)
    ]
    bpy.context.view_layer.update()
    mesh = _mesh_of(pebble)
    shift = np.array(offset, np.float64)
    moved = [Camera(item.label, _shifted(item.to_world, shift), item.lens) for item in cameras]
    positions = mesh.positions + shift
    return Reconstruction(moved, Mesh(positions, mesh.normals, mesh.triangles, mesh.uvs), [])


def _add_pebble() -> bpy.types.Object:
    """A smooth, uneven body 8 cm wide with a UV map, closed."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16, radius=0.04)
    pebble = bpy.context.object
    pebble.name = pebble.data.name = MATERIAL
    for vertex in pebble.data.vertices:
        x, y, z = vertex.co / 0.04
        swell = 1 + 0.15 * math.sin(2 * x + y) + 0.1 * math.cos(3 * y - z)
        vertex.co = (0.04 * swell * x, 0.03 * swell * y, 0.025 * swell * z)
    pebble.data.polygons.foreach_set("use_smooth", [True] * len(pebble.data.polygons))
    pebble.data.materials.append(principled(MATERIAL, TRUTH))
    return pebble


def _pose(azimuth: float, height: float, distance: float) -> np.ndarray:
    """4 x 4 of a camera that looks at the origin along +z, y down."""
    a, h = math.radians(azimuth), math.radians(height)
    place = mathutils.Vector((math.cos(a) * math.cos(h), math.sin(a) * math.cos(h), math.sin(h)))
    blender = (-place).to_track_quat("-Z", "Y").to_matrix().to_4x4()
    # Orthonormal in double, whatever single precision made of it.
    left, _, right = np.linalg.svd(np.array(blender, np.float64)[:3, :3])
    matrix = np.eye(4)
    matrix[:3, :3] = left @ right @ np.diag([1.0, -1.0, -1.0])
    matrix[:3, 3] = distance * np.array(place, np.float64)
    return matrix


def _shifted(matrix: np.ndarray, shift: np.ndarray) -> np.ndarray:
    moved = matrix.copy()
    moved[:3, 3] += shift
    return moved


def _mesh_of(item: bpy.types.Object) -> Mesh:
    """Triangles whose corners have a vertex of their own for each UV, as scanners write them."""
    data = item.data
    data.calc_loop_triangles()
    count = len(data.loop_triangles) * 3
    loops, vertices = np.empty(count, np.int32), np.empty(count, np.int32)
    data.loop_triangles.foreach_get("loops", loops)
    data.loop_triangles.foreach_get("vertices", vertices)
    uvs = np.empty(len(data.loops) * 2, np.float32)
    data.uv_layers[0].data.foreach_get("uv", uvs)
    positions, normals = (np.empty(len(data.vertices) * 3, np.float32) for _ in range(2))
    data.vertices.foreach_get("co", positions)
    data.vertices.foreach_get("normal", normals)
    keys = np.column_stack([vertices, uvs.reshape(-1, 2)[loops]])
    kept, number = np.unique(keys, axis=0, return_inverse=True)
    chosen = kept[:, 0].astype(int)
    return Mesh(
        positions.reshape(-1, 3)[chosen].astype(np.float64),
        normals.reshape(-1, 3)[chosen].astype(np.float64),
        number.reshape(-1, 3),
        kept[:, 1:],
    )


def take_photos(cameras: list[Camera], folder: Path, samples: int) -> list[Path]:
    """Renders of the open scene by Cycles through a wider pinhole, brought to the photo's pixels
    as the lens would; OpenEXR, since what is tested is geometry and not the file's 8 bits."""
    from selenite import native

    folder.mkdir(parents=True, exist_ok=True)
    scene = bpy.context.scene
    set_comparison(scene, samples, seed=1)
    image = scene.render.image_settings
    image.file_format, image.color_mode, image.color_depth = "OPEN_EXR", "RGB", "32"
    data = bpy.data.cameras.new("Photographer")
    item = bpy.data.objects.new("Photographer", data)
    scene.collection.objects.link(item)
    scene.camera = item
    width, height = (int(_MARGIN * _FINER * side) for side in SIZE)
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.resolution_percentage = 100
    focal = _FINER * LENS.fx
    data.sensor_fit, data.sensor_width, data.lens = "HORIZONTAL", 36.0, focal * 36.0 / width
    data.clip_start = 0.001
    photos = []
    for number, camera in enumerate(cameras):
        item.matrix_world = mathutils.Matrix(
            (camera.to_world @ np.diag([1.0, -1.0, -1.0, 1.0])).tolist()
        )
        set_comparison(scene, samples, seed=number)
        wide = folder / f"wide_{camera.label}.exr"
        scene.render.filepath = str(wide)
        bpy.ops.render.render(write_still=True)
        pixels = native.image().read(str(wide))[0]
        wide.unlink()
        photos.append(folder / f"{camera.label}.exr")
        native.image().write_exr(str(photos[-1]), _through_lens(pixels, focal, camera.lens))
    bpy.data.objects.remove(item)
    return photos


def _through_lens(pixels: np.ndarray, focal: float, lens: Lens) -> np.ndarray:
    """(h, w, 3) of a centred pinhole -> the photo: the mean of a pixel's parts, each the value of
    the pinhole's picture there, linear between its pixels."""
    parts = (np.arange(_PARTS) + 0.5) / _PARTS
    across = (np.arange(lens.width)[:, None] + parts).ravel()
    down = (np.arange(lens.height)[:, None] + parts).ravel()
    slopes = lens.slopes(np.stack(np.meshgrid(across, down), axis=-1))
    height, width = pixels.shape[:2]
    x = np.clip(slopes[..., 0] * focal + width / 2 - 0.5, 0, width - 1.001)
    y = np.clip(slopes[..., 1] * focal + height / 2 - 0.5, 0, height - 1.001)
    left, top = x.astype(int), y.astype(int)
    u, v = (x - left)[..., None], (y - top)[..., None]
    fine = (1 - v) * ((1 - u) * pixels[top, left] + u * pixels[top, left + 1])
    fine += v * ((1 - u) * pixels[top + 1, left] + u * pixels[top + 1, left + 1])
    shape = (lens.height, len(parts), lens.width, len(parts), 3)
    return fine.reshape(shape).mean(axis=(1, 3)).astype(np.float32)


def write_all(found: Reconstruction, folder: Path) -> dict[str, list[str]]:
    """Every format below `folder`, beside its photos; words of `selenite import` for each."""
    folder.mkdir(parents=True, exist_ok=True)
    names = [f"{camera.label}.exr" for camera in found.cameras]
    files.write_metashape(folder / "cameras.xml", found.cameras)
    files.write_x3d(folder / "pebble.x3d", found.mesh, found.cameras)
    files.write_obj(folder / "pebble.obj", found.mesh)
    points = found.mesh.positions[::7]
    files.write_colmap(folder / "text", found.cameras, names, points, binary=False)
    files.write_colmap(folder / "binary", found.cameras, names, points, binary=True)
    files.write_transforms(
        folder / "transforms.json", found.cameras, [f"photos/{name}" for name in names]
    )
    photos = ["--photos", str(folder / "photos")]
    x3d, mesh = str(folder / "pebble.x3d"), str(folder / "pebble.obj")
    return {
        "metashape": [x3d, "--cameras", str(folder / "cameras.xml"), *photos],
        "colmap text": [mesh, "--cameras", str(folder / "text"), *photos],
        "colmap binary": [mesh, "--cameras", str(folder / "binary"), *photos],
        "transforms": [mesh, "--cameras", str(folder / "transforms.json")],
    }


def save_original(found: Reconstruction, folder: Path) -> tuple[Path, Path]:
    """The scene itself with its cameras and a file of captures: (original.blend, captures.json)."""
    scene = bpy.context.scene
    captures = []
    for camera, photo in zip(found.cameras, found.photos, strict=True):
        lens = camera.lens
        data = bpy.data.cameras.new(camera.label)
        data.sensor_fit, data.sensor_width = "HORIZONTAL", 36.0
        data.lens = lens.fx * 36.0 / lens.width
        data.shift_x = 0.5 - lens.cx / lens.width
        data.shift_y = (lens.cy - lens.height / 2) / lens.width * lens.fx / lens.fy
        data.clip_start = 0.001
        item = bpy.data.objects.new(camera.label, data)
        item.matrix_world = mathutils.Matrix(
            (camera.to_world @ np.diag([1.0, -1.0, -1.0, 1.0])).tolist()
        )
        scene.collection.objects.link(item)
        names = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2")
        captures.append(
            {
                "camera": camera.label,
                "photo": str(photo),
                "size": [lens.width, lens.height],
                "pixel_aspect": lens.fy / lens.fx,
                "distortion": {name: getattr(lens, name) for name in names},
            }
        )
        scene.camera = item
    path, listed = folder / "original.blend", folder / "captures.json"
    listed.write_text(json.dumps({"schema": 1, "captures": captures}, indent=1))
    bpy.ops.wm.save_as_mainfile(filepath=str(path), check_existing=False)
    return path, listed


def main() -> None:
    """The command line, in Python or behind Blender's `--`."""
    rest = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder for all that is written")
    parser.add_argument("--spp", type=int, default=64, help="samples of the photos")
    parser.add_argument("--fit", action="store_true", help="import each, fit, compare")
    options = parser.parse_args(rest)
    folder = options.out.resolve()
    found = build()
    photos = take_photos(found.cameras, folder / "photos", options.spp)
    found = Reconstruction(found.cameras, found.mesh, photos)
    words = write_all(found, folder)
    original = save_original(found, folder)
    print(f"wrote {folder}")
    if not options.fit:
        for name, arguments in words.items():
            print(f"{name}: selenite import {' '.join(arguments)} --save {name[:8]}.blend")
        return
    for name, values in fit_each(words, original, folder).items():
        print(f"{name:14} " + "  ".join(f"{key} {value}" for key, value in values.items()))


def fit_each(
    words: dict[str, list[str]], original: tuple[Path, Path], folder: Path
) -> dict[str, dict[str, list[float]]]:
    """Fitted values of the original scene and of each reconstruction, by name."""
    from selenite.cli import main as selenite

    scenes = {"original": (original[0], MATERIAL, ["--captures", str(original[1])])}
    for number, (name, arguments) in enumerate(words.items()):
        scene = folder / f"import{number}.blend"
        if selenite(["import", *arguments, "--save", str(scene)]) != 0:
            raise SystemExit(f"{name} cannot be imported")
        scenes[name] = (scene, "pebble", [])
    found = {}
    for name, (scene, material, more) in scenes.items():
        out = folder / "fits" / name.replace(" ", "_")
        wanted = ["--fit", f"{material}:base_color,roughness", "--fit", "World:strength"]
        start = ["--start", f"{material}:base_color=0.5,0.5,0.5", "--start", "World:strength=1"]
        start += ["--start", f"{material}:roughness=0.6"]
        fit = ["fit", str(scene), *wanted, *start, *more, "--out", str(out)]
        fit += ["--preset", "draft", "--search", "off", "--height", "72", "--seed", "1"]
        if selenite(fit) != 0:
            raise SystemExit(f"{name} cannot be fitted")
        result = json.loads(max(out.glob("*/result.json")).read_text())
        found[name] = _values_of(result)
    return found


def _values_of(result: dict) -> dict[str, list[float]]:
    """By parameter, without the owner, whose name differs."""
    rows = result["parameters"].items()
    return {name.partition(":")[2]: row["value"] for name, row in rows}


if __name__ == "__main__":
    main()
