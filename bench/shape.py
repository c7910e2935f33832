# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench shape [ROW ...]`: shapes, colours and roughness fitted to photos by Cycles.

Eight cameras photograph a body under an area lamp and a bright sky. `blob`: from a scaled sphere to
a body with bumps, the material known. `colors`: the vertex colours of that body, from grey. The
other rows are those of the bird of the 2022 thesis (`./dev bench bird`), from shared/data beside
this checkout (skipped where it is absent): a scan whose vertices are off by 1 % of its size, fitted
by a colour map; by map and roughness; by vertices and map; and a scaled sphere fitted by vertices,
colour and roughness. Shape comes before colours, then all take turns: see docs/guide/shape.md.

A row each: mean distance of vertices from the true surface before and after, as a share of the
diagonal of its bounding box; faces that are turned over; PSNR of a map by places of the surface, or
of vertex colours, where the photos see them; the error of a ninth photo, as a share of its
brightness; seconds of CPU for an iteration.
"""

from __future__ import annotations

import argparse
import math
import os
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "bench"), str(ROOT / "blender_tests")]

import bpy  # noqa: E402
import made_scenes as made  # type: ignore[import-not-found]  # noqa: E402
from mathutils import Vector  # noqa: E402
from mathutils.bvhtree import BVHTree  # noqa: E402
from synthetic.in_process import print_rows, report_of  # noqa: E402

from selenite import native  # noqa: E402
from selenite.cycles_check.render_settings import set_comparison  # noqa: E402

MESHES = ROOT.parent / "shared/data/meshes"
_SCAN = "penguin_26880.obj"
_CAMERAS, _AWAY, _FIELD = 8, 4.0, 0.62
_PAINTED, _PLAIN = 512, 0.5  # texels along the true map; a start's grey
_ROUGHNESS = 0.35
_VERTICES = "Body:vertex_positions"
_MAP = "Body:base_color_texture"
_PLACES, _SEEN = 20_000, 0.2  # where a map is compared; of coverage
_COLORS = "Body:vertex_colors"


@dataclass(frozen=True)
class Mapped:
    """faces (t, 3): vertices of triangles; uv (t, 3, 2): the map's places at their corners."""

    faces: np.ndarray
    uv: np.ndarray


@dataclass(frozen=True)
class Row:
    """scan: starts at the scan with noise, else at a scaled sphere. mapped: the body has a colour
    map. fits: what is fitted. painted: the body has vertex colours, and starts at its true shape.
    roughness: that of the start."""

    scan: bool
    mapped: bool
    fits: tuple[str, ...]
    bird: bool = True
    painted: bool = False
    roughness: float = _ROUGHNESS


ROWS = {
    "blob": Row(False, False, (_VERTICES,), bird=False),
    "colors": Row(False, False, (_COLORS,), bird=False, painted=True),
    "map": Row(True, True, (_MAP,)),
    "map-roughness": Row(True, True, (_MAP, "Body:roughness"), roughness=0.7),
    "shape-map": Row(True, True, (_VERTICES, _MAP)),
    "sphere": Row(False, False, (_VERTICES, "Body:base_color", "Body:roughness"), roughness=0.7),
}


def _pattern(columns: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """The colours of the map, by u and v in [0, 1]."""
    waves = np.sin(2 * math.pi * 5 * columns) * np.sin(2 * math.pi * 4 * rows)
    red = 0.45 + 0.3 * waves
    green = 0.4 + 0.25 * np.cos(2 * math.pi * 3 * (columns + rows))
    return np.stack([red, green, 0.7 - red], axis=-1).astype(np.float32)


def _mesh_of(vertices: np.ndarray, faces: np.ndarray) -> Any:  # noqa: ANN401
    mesh = bpy.data.meshes.new("Body")
    mesh.from_pydata(vertices.tolist(), [], faces.tolist())
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    mesh.update()
    return mesh


def _bird(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Vertices, about `count`, and triangles of the scan, upright and at most 1 from the middle."""
    bpy.ops.wm.obj_import(filepath=str(MESHES / _SCAN))
    item = bpy.context.selected_objects[0]
    bpy.context.view_layer.objects.active = item
    bpy.ops.object.transform_apply()
    modifier = item.modifiers.new("Decimate", "DECIMATE")
    modifier.ratio = count / len(item.data.vertices)
    bpy.ops.object.modifier_apply(modifier=modifier.name)
    mesh = item.data
    mesh.calc_loop_triangles()
    vertices = np.array([vertex.co for vertex in mesh.vertices])
    faces = np.array([list(one.vertices) for one in mesh.loop_triangles])
    bpy.data.objects.remove(item)
    vertices -= (vertices.max(0) + vertices.min(0)) / 2
    return vertices / np.linalg.norm(vertices, axis=1).max(), faces


def _sphere(count: int) -> tuple[np.ndarray, np.ndarray]:
    subdivisions = 4 if count > 700 else 3
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=subdivisions + 1, radius=1)
    item = bpy.context.object
    vertices = np.array([vertex.co for vertex in item.data.vertices])
    faces = np.array([list(one.vertices) for one in item.data.polygons])
    bpy.data.objects.remove(item)
    return vertices, faces


def _bumps(n: np.ndarray) -> np.ndarray:
    """Distance of the blob's surface in a direction."""
    x, y, z = n.T
    return 0.68 * (1.1 + 0.25 * x * y + 0.15 * np.sin(3 * z + 1) + 0.1 * y)


def _noise(vertices: np.ndarray, faces: np.ndarray, share: float) -> np.ndarray:
    """In random directions that change smoothly, as a scan is off; `share`: of the diagonal."""
    found = np.random.default_rng(5).normal(size=vertices.shape)
    pairs = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    pairs = np.unique(np.sort(pairs, axis=1), axis=0)
    for _ in range(2):
        sums, counts = found.copy(), np.ones(len(found))
        for a, b in (pairs.T, pairs.T[::-1]):
            np.add.at(sums, a, found[b])
            np.add.at(counts, a, 1)
        found = sums / counts[:, None]
    size = np.linalg.norm(np.ptp(vertices, axis=0))
    return found * (share * size / np.linalg.norm(found, axis=1).mean())


def _uv_of(mesh: Any, faces: np.ndarray) -> np.ndarray:  # noqa: ANN401
    """Of its triangles, (t, 3, 2)."""
    flat = np.zeros(6 * len(faces), np.float32)
    mesh.uv_layers.active.data.foreach_get("uv", flat)
    return flat.reshape(-1, 3, 2)


def _scene(mesh: Any, row: Row, height: int) -> Any:  # noqa: ANN401
    """The body, light and cameras; its material is that of the truth, without a map."""
    item = made.add("Body", mesh)
    body = made.material("Body", base_color=(0.6, 0.45, 0.3), roughness=_ROUGHNESS)
    mesh.materials.append(body)
    if row.mapped:
        bpy.context.view_layer.objects.active = item
        item.select_set(True)
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.uv.smart_project(island_margin=0.02)
        bpy.ops.object.mode_set(mode="OBJECT")
    made.world(strength=1.0, color=(0.5, 0.5, 0.55))
    lamp = made.light("Lamp", "AREA", energy=120, size=1.0)
    lamp.location, lamp.visible_camera = (2.0, -1.5, 3.0), False
    lamp.rotation_euler = (-Vector(lamp.location)).to_track_quat("-Z", "Y").to_euler()
    for index in range(_CAMERAS + 1):
        camera = made.camera(f"Camera {index}")
        turn = 2 * math.pi * (index + 0.5 * (index == _CAMERAS)) / _CAMERAS
        above = 1.6 if index % 2 else -0.6
        camera.location = (_AWAY * math.cos(turn), _AWAY * math.sin(turn), above)
        camera.rotation_euler = (-Vector(camera.location)).to_track_quat("-Z", "Y").to_euler()
        camera.data.angle = _FIELD
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = height
    scene.camera = bpy.data.objects["Camera 0"]
    return item


def _paint(pixels: np.ndarray) -> None:
    """An image of these linear colours as the base colour."""
    rows, columns = pixels.shape[:2]
    image = bpy.data.images.new("Map", columns, rows, float_buffer=True)
    image.colorspace_settings.name = "Linear Rec.709"
    flat = np.ones((rows, columns, 4), np.float32)
    flat[..., :3] = pixels[::-1]
    image.pixels.foreach_set(flat.ravel())
    image.pack()
    material = bpy.data.materials["Body"]
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    made.link(material, node.outputs["Color"])


def _colors(vertices: np.ndarray) -> np.ndarray:
    """The true colours of these vertices."""
    turn = np.arctan2(vertices[:, 1], vertices[:, 0]) / (2 * math.pi)
    return _pattern(turn, 0.5 + vertices[:, 2] / 2)


def _paint_vertices(item: Any, colors: np.ndarray) -> None:  # noqa: ANN401
    """A colour attribute as the base colour."""
    attribute = item.data.color_attributes.new("Color", "FLOAT_COLOR", "POINT")
    flat = np.ones((len(colors), 4), np.float32)
    flat[:, :3] = colors
    attribute.data.foreach_set("color", flat.ravel())
    material = bpy.data.materials["Body"]
    node = material.node_tree.nodes.new("ShaderNodeVertexColor")
    node.layer_name = "Color"
    made.link(material, node.outputs["Color"])


def _photograph(folder: Path, samples: int) -> None:
    scene = bpy.context.scene
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    for index in range(_CAMERAS + 1):
        scene.camera = bpy.data.objects[f"Camera {index}"]
        set_comparison(scene, samples, seed=index)
        scene.render.filepath = str(folder / f"{index}.exr")
        bpy.ops.render.render(write_still=True)


def distance(points: np.ndarray, vertices: np.ndarray, faces: np.ndarray) -> float:
    """Mean distance of points from a surface, in diagonals of its bounding box."""
    tree = BVHTree.FromPolygons(vertices.tolist(), faces.tolist())
    far = np.mean([tree.find_nearest(Vector(one))[3] for one in points])
    return float(far / np.linalg.norm(np.ptp(vertices, axis=0)))


def turned(points: np.ndarray, vertices: np.ndarray, faces: np.ndarray) -> int:
    """Triangles of a mesh whose normals have turned from those that it had."""

    def doubled(where: np.ndarray) -> np.ndarray:
        a, b, c = (where[faces[:, k]] for k in range(3))
        return np.cross(b - a, c - a)

    return int(((doubled(points) * doubled(vertices)).sum(1) <= 0).sum())


def _looked_up(image: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """The texel at each place, (n, channels)."""
    rows, columns = image.shape[:2]
    column = np.clip((uv[:, 0] * columns).astype(int), 0, columns - 1)
    row = np.clip(((1 - uv[:, 1]) * rows).astype(int), 0, rows - 1)
    return image[row, column]


def map_psnr(
    folder: Path, row: dict[str, Any], mesh: Mapped, after: np.ndarray, true: np.ndarray
) -> float:
    """In dB, in linear light, where the photos see the fitted surface. A place on it is compared
    with the nearest one on the true surface: a map that slides along a surface with its vertices
    shows the same picture, so texels alone cannot be compared.
    """
    found = native.image().read(str(folder / row["files"][0]))[0]
    coverage = native.image().read(str(folder / row["files"][1]))[0]
    tree = BVHTree.FromPolygons(true.tolist(), mesh.faces.tolist())
    random = np.random.default_rng(3)
    sides = [after[mesh.faces[:, k]] - after[mesh.faces[:, 0]] for k in (1, 2)]
    areas = np.linalg.norm(np.cross(*sides), axis=1)
    face = random.choice(len(areas), _PLACES, p=areas / areas.sum())
    share = random.dirichlet(np.ones(3), _PLACES)
    places = np.einsum("pk,pkx->px", share, after[mesh.faces[face]])
    uv = np.einsum("pk,pkx->px", share, mesh.uv[face])
    wanted = []
    for place in places:
        nearest, _, index, _ = tree.find_nearest(Vector(place))
        corners = true[mesh.faces[index]]
        weights = np.linalg.lstsq(
            np.vstack([corners.T, np.ones(3)]), np.append(nearest, 1), rcond=None
        )[0]
        wanted.append(weights @ mesh.uv[index])
    gap = _looked_up(found, uv) - _pattern(*np.array(wanted).T)
    seen = _looked_up(coverage, uv)[:, 0] > _SEEN
    return float(-10 * np.log10(np.mean(gap[seen].astype(float) ** 2)))


def color_psnr(folder: Path, row: dict[str, Any], wanted: np.ndarray) -> float:
    """In dB, of vertex colours that have left their start, in linear light."""
    found = np.load(folder / row["files"][0])
    seen = np.abs(found - _PLAIN).max(axis=1) > 1e-6  # noqa: PLR2004 - rounding
    return float(-10 * np.log10(np.mean((found - wanted)[seen].astype(float) ** 2)))


def examine(name: str, options: argparse.Namespace, more: list[str], folder: Path) -> str:
    """The table's row."""
    row = ROWS[name]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if row.bird:
        true, faces = _bird(options.vertices)
    else:
        ball, faces = _sphere(options.vertices if row.painted else 4 * options.vertices)
        true = ball * _bumps(ball)[:, None]
    item = _scene(_mesh_of(true, faces), row, options.height)
    if row.painted:
        _paint_vertices(item, _colors(true))
    if row.mapped:
        places = (np.arange(_PAINTED) + 0.5) / _PAINTED
        _paint(_pattern(*np.meshgrid(places, 1 - places)))
    photos = folder / name
    photos.mkdir(exist_ok=True)
    if not (photos / f"{_CAMERAS}.exr").exists():
        _photograph(photos, options.samples)

    start, of_start = true, faces
    if row.scan:
        start = true + _noise(true, faces, options.noise)
    elif not row.painted:
        ball, of_start = _sphere(options.vertices)
        start = ball * (0.5 * np.ptp(true, axis=0) * 0.9) + (true.max(0) + true.min(0)) / 2
    bpy.ops.wm.read_factory_settings(use_empty=True)
    item = _scene(_mesh_of(true if row.scan else start, of_start), row, options.height)
    if row.scan:  # with the map's places of the true mesh
        item.data.vertices.foreach_set("co", start.astype(np.float32).ravel())
        item.data.update()
    if row.painted:
        _paint_vertices(item, np.full_like(true, _PLAIN))
    body = bpy.data.materials["Body"]
    made.socket(body, "roughness").default_value = row.roughness
    if row.mapped or "Body:base_color" in row.fits:
        made.socket(body, "base_color").default_value = (_PLAIN, _PLAIN, _PLAIN, 1)
    uv = _uv_of(item.data, faces) if row.mapped else np.zeros(0)
    scene = photos / "start.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(scene))
    words = [word for fitted in row.fits for word in ("--fit", fitted)]
    words += [f"--photo=Camera {i}={photos / f'{i}.exr'}" for i in range(_CAMERAS)]
    if row.mapped:
        words += ["--grid", f"{_MAP}={options.texels}"]
    fitted = photos / "fitted.blend"
    result = report_of(
        "fit", str(scene), *words, "--height", str(options.height), "--spp", str(options.spp),
        "--iterations", str(options.iterations), "--out", str(photos / "fits"),
        "--save", str(fitted), *more,
    )  # fmt: skip
    out = Path(result["folder"])
    after = np.load(out / "Body_vertex_positions.npy") if _VERTICES in row.fits else start
    psnr = math.nan
    if row.mapped:
        psnr = map_psnr(out, result["parameters"][_MAP], Mapped(faces, uv), after, true)
    if row.painted:
        psnr = color_psnr(out, result["parameters"][_COLORS], _colors(true))
    shown = photos / "unseen.exr"
    report_of(
        "render", str(fitted), "--camera", f"Camera {_CAMERAS}", "--height", str(options.height),
        "--spp", "128", "--out", str(shown),
    )  # fmt: skip
    unseen = native.image().read(str(photos / f"{_CAMERAS}.exr"))[0].astype(float)
    error = native.image().read(str(shown))[0].astype(float) - unseen
    values = {
        key.partition(":")[2]: np.round(entry["value"], 3).tolist()
        for key, entry in result["parameters"].items()
        if key.endswith((":roughness", ":base_color"))
    }
    return (
        f"| {name} | {100 * distance(start, true, faces):.2f} % | "
        f"{100 * distance(after, true, faces):.2f} % | {turned(after, start, of_start)} | "
        f"{psnr:.1f} | {np.sqrt((error**2).mean() / (unseen**2).mean()):.3f} | "
        f"{result['cpu_seconds'] / max(result['iterations'], 1):.2f} | {values} |"
    )


def main(usual: tuple[str, ...] = tuple(ROWS), prog: str = "./dev bench shape") -> int:
    """Prints the table; `usual`: its rows where none is asked for."""
    asked = argparse.ArgumentParser(prog=prog, description=__doc__)
    asked.add_argument("rows", nargs="*", metavar="ROW", help=f"of {', '.join(ROWS)}")
    asked.add_argument("--height", type=int, default=64, help="of photos and fits (%(default)s)")
    asked.add_argument("--samples", type=int, default=512, help="of photos (%(default)s)")
    asked.add_argument("--vertices", type=int, default=1200, help="of a start, about (%(default)s)")
    asked.add_argument("--texels", type=int, default=128, help="along a map (%(default)s)")
    asked.add_argument("--noise", type=float, default=0.01, help="of a scan (%(default)s)")
    asked.add_argument("--iterations", type=int, default=100, help="of a stage (%(default)s)")
    asked.add_argument("--spp", type=int, default=16, help="of the fits (%(default)s)")
    asked.add_argument("--folder", help="kept; a later run takes its photos")
    options, more = asked.parse_known_args()  # the rest goes to the fits

    def row_of(name: str, folder: Path) -> str:
        if ROWS[name].bird and not (MESHES / _SCAN).is_file():
            return f"| {name} | skipped: {MESHES / _SCAN} is absent |"
        return examine(name, options, more, folder)

    header = "| row | distance | after | turned | PSNR | held out | CPU s / iteration | found |"
    print_rows(header, options.rows or usual, row_of, options.folder)
    return 0


if __name__ == "__main__":
    status = main()
    sys.stderr.flush()
    os._exit(status)  # bpy may hang in its own destructors
