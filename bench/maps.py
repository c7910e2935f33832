# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench maps [ROW ...]`: images of a material fitted to four photos by Cycles.

A body in a room, photographed by five cameras around it; the last photo judges. `roughness`: a ball
with a map of roughness, its colour known. `spot`: the cow of shared/data beside this checkout with
its own texture (skipped where it is absent). `subsurface`: the same, half of it subsurface
scattering. `normal`: a ball with a normal map of bumps. `memory`: a ball of 200,000 triangles with
an image of 2048 x 2048 texels, a few iterations.

All photos of a texel see the same light, and white light tells one number of its two slopes but
for highlights. Who captures a normal map therefore lights it in colours: in `normal` red, green and
blue come from different sides, by six soft lamps in a dim room, as in photometric stereo.

A row each: error of the texels that photos see, their share, the error of the last photo in dB
below its brightest tenth, iterations, CPU seconds and the peak of memory. The error of a colour is
1 over its root mean square, in dB: of linear values and of those that an 8-bit file holds.
"""

from __future__ import annotations

import argparse
import math
import os
import resource
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
from synthetic.in_process import print_rows, report_of  # noqa: E402

from selenite import native  # noqa: E402
from selenite.cycles_check.render_settings import set_comparison  # noqa: E402

DATA = ROOT.parent / "shared" / "data"
_CAMERAS = 5
#: Of the largest coverage in a coverage image, from which texels count as seen (`fields.seen`).
_SEEN = 0.05
_NODE = "Map"


@dataclass(frozen=True)
class Row:
    """name: what is fitted. cow: the body of shared/data. weight: of subsurface scattering.
    colored: the light has another colour from each side."""

    name: str
    cow: bool = False
    weight: float = 0.0
    faces: int = 4096
    texels: int = 256
    colored: bool = False


#: Place, colour, power in W and size of each lamp.
_WHITE_LAMPS = (
    ((2.0, -1.5, 3.0), (1.0, 1.0, 1.0), 80, 1.0),
    ((-2.5, 2.0, 1.0), (1.0, 1.0, 1.0), 80, 1.0),
)
_COLORED_LAMPS = tuple(
    (place, color, 300, 3.0)
    for place, color in (
        ((4.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
        ((-4.0, 0.0, 0.0), (0.0, 1.0, 1.0)),
        ((0.0, 4.0, 0.0), (0.0, 1.0, 0.0)),
        ((0.0, -4.0, 0.0), (1.0, 0.0, 1.0)),
        ((0.0, 0.0, 4.0), (0.0, 0.0, 1.0)),
        ((0.0, 0.0, -4.0), (1.0, 1.0, 0.0)),
    )
)

ROWS = {
    "roughness": Row("roughness_texture"),
    "spot": Row("base_color_texture", cow=True),
    "subsurface": Row("base_color_texture", cow=True, weight=0.5),
    "normal": Row(f"{_NODE}.image", texels=64, colored=True),
    "memory": Row("base_color_texture", faces=200_000, texels=2048),
}


def _grid(side: int) -> tuple[np.ndarray, np.ndarray]:
    at = (np.arange(side) + 0.5) / side
    u, v = np.meshgrid(at, 1 - at)
    return u, v


def truth(name: str, side: int) -> np.ndarray:
    """(side, side, 1 or 3) in linear numbers, row 0 at the top."""
    u, v = _grid(side)
    if name in ("spot", "subsurface"):
        pixels = native.image().read(str(DATA / "meshes/spot/spot_texture.png"))[0]
        step = pixels.shape[0] // side
        return pixels.reshape(side, step, side, step, 3).mean((1, 3))
    waves = np.sin(2 * math.pi * 4 * u) * np.sin(2 * math.pi * 3 * v)
    if name == "roughness":
        return (0.4 + 0.2 * waves)[..., None].astype(np.float32)
    if name == "normal":
        slope_u = 0.3 * np.cos(2 * math.pi * 6 * u) * np.sin(2 * math.pi * 4 * v)
        slope_v = 0.3 * np.sin(2 * math.pi * 6 * u) * np.cos(2 * math.pi * 4 * v)
        normals = np.dstack([slope_u, slope_v, np.ones_like(u)])
        normals /= np.linalg.norm(normals, axis=2, keepdims=True)
        return (normals / 2 + 0.5).astype(np.float32)
    return np.dstack([0.4 + 0.3 * waves, 0.4 - 0.2 * waves, np.full_like(u, 0.3)]).astype("f4")


def _image(pixels: np.ndarray, *, data: bool) -> Any:  # noqa: ANN401
    rows, columns, channels = pixels.shape
    image = bpy.data.images.new(_NODE, columns, rows, float_buffer=True)
    image.colorspace_settings.name = "Non-Color" if data else "Linear Rec.709"
    flat = np.ones((rows, columns, 4), np.float32)
    flat[..., :3] = np.broadcast_to(pixels[::-1], (rows, columns, 3)) if channels == 1 else (
        pixels[::-1]
    )  # fmt: skip
    image.pixels.foreach_set(flat.ravel())
    image.pack()
    return image


def _body(row: Row) -> Any:  # noqa: ANN401
    """Two units across, with UVs, smooth, in Body."""
    if row.cow:
        bpy.ops.wm.obj_import(filepath=str(DATA / "meshes/spot/spot_triangulated.obj"))
        item = bpy.context.selected_objects[0]
        item.data.materials.clear()
    else:
        segments = 2 * round(math.sqrt(row.faces / 4))
        item = made.sphere(segments=segments)
    item.name = "Body"
    item.data.polygons.foreach_set("use_smooth", [True] * len(item.data.polygons))
    return item


def _scene(row: Row, height: int) -> Any:  # noqa: ANN401
    """Body, room, lamp and cameras; returns the material, even and grey."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    item = _body(row)
    body = made.material("Body", base_color=(0.5, 0.5, 0.5), roughness=0.4)
    item.data.materials.append(body)
    if row.weight:
        inputs = made.principled(body).inputs
        inputs["Subsurface Weight"].default_value = row.weight
        inputs["Subsurface Scale"].default_value = 0.1
    world = made.world(strength=1.0)
    panorama = world.node_tree.nodes.new("ShaderNodeTexEnvironment")
    panorama.image = bpy.data.images.load(str(DATA / "hdri/interior.exr"))
    background = next(n for n in world.node_tree.nodes if n.bl_idname == "ShaderNodeBackground")
    world.node_tree.links.new(panorama.outputs["Color"], background.inputs["Color"])
    if row.colored:
        background.inputs["Strength"].default_value = 0.2
    for index, (place, color, watts, size) in enumerate(
        _COLORED_LAMPS if row.colored else _WHITE_LAMPS
    ):
        lamp = made.light(f"Lamp {index}", "AREA", energy=watts, size=size, color=color)
        lamp.location, lamp.visible_camera = place, False
        lamp.rotation_euler = (-Vector(place)).to_track_quat("-Z", "Y").to_euler()
    for index in range(_CAMERAS):
        camera = made.camera(f"Camera {index}")
        turn = 2 * math.pi * (index + 0.5 * (index == _CAMERAS - 1)) / (_CAMERAS - 1)
        camera.location = (4 * math.cos(turn), 4 * math.sin(turn), 1.6 if index % 2 else -0.6)
        camera.rotation_euler = (-Vector(camera.location)).to_track_quat("-Z", "Y").to_euler()
        camera.data.angle = 0.6
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = height
    scene.camera = bpy.data.objects["Camera 0"]
    return body


def _show(body: Any, name: str, pixels: np.ndarray) -> None:  # noqa: ANN401
    """Links the image to what it is of."""
    tree = body.node_tree
    node = tree.nodes.new("ShaderNodeTexImage")
    node.name = _NODE
    node.image = _image(pixels, data=name in ("roughness", "normal"))
    if name == "normal":
        bend = tree.nodes.new("ShaderNodeNormalMap")
        tree.links.new(node.outputs["Color"], bend.inputs["Color"])
        tree.links.new(bend.outputs["Normal"], made.principled(body).inputs["Normal"])
        return
    made.link(body, node.outputs["Color"], "roughness" if name == "roughness" else "base_color")


def _photograph(folder: Path, samples: int) -> None:
    scene = bpy.context.scene
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    for index in range(_CAMERAS):
        path = folder / f"{index}.exr"
        if path.exists():  # of an earlier run
            continue
        scene.camera = bpy.data.objects[f"Camera {index}"]
        set_comparison(scene, samples, seed=index)
        scene.render.filepath = str(path)
        bpy.ops.render.render(write_still=True)


def _coded(linear: np.ndarray) -> np.ndarray:
    """As an 8-bit image holds colours, from 0 to 1."""
    lit = np.clip(linear.astype(float), 0, 1)
    return np.where(lit < 0.0031308, 12.92 * lit, 1.055 * lit ** (1 / 2.4) - 0.055)


def _error(name: str, found: np.ndarray, wanted: np.ndarray, seen: np.ndarray) -> str:
    """Of the texels that are seen."""
    if name == "normal":
        ours, theirs = (2 * one[seen].astype(float) - 1 for one in (found, wanted))
        cosine = (ours * theirs).sum(1) / (
            np.linalg.norm(ours, axis=1) * np.linalg.norm(theirs, axis=1)
        )
        angles = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
        return f"{angles.mean():.1f} degrees"
    off = (found[..., : wanted.shape[2]] - wanted)[seen].astype(float)
    rms = math.sqrt((off**2).mean())
    if name == "roughness":
        return f"{rms:.3f}, mean {np.abs(off).mean():.3f}"
    coded = (_coded(found[..., :3]) - _coded(wanted))[seen]
    shown = math.sqrt((coded**2).mean())
    return f"{-20 * math.log10(rms):.1f} dB, coded {-20 * math.log10(shown):.1f} dB"


def examine(name: str, options: argparse.Namespace, more: list[str], folder: Path) -> str:
    """The table's row."""
    row, texels = ROWS[name], options.texels or ROWS[name].texels
    photos = folder / name
    photos.mkdir(exist_ok=True)
    pixels = truth(name, min(texels, 1024))
    _show(_scene(row, options.height), name, pixels)
    _photograph(photos, options.samples)
    body = _scene(row, options.height)
    if name == "normal":
        _show(body, name, np.full((texels, texels, 3), (0.5, 0.5, 1), np.float32))
    start, fitted = photos / "start.blend", photos / "fitted.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(start))
    words = [f"--photo=Camera {i}={photos / f'{i}.exr'}" for i in range(_CAMERAS - 1)]
    if name != "normal":
        words += ["--grid", f"Body:{row.name}={texels}"]
    result = report_of(
        "fit", str(start), "--fit", f"Body:{row.name}", *words, "--height", str(options.height),
        "--out", str(photos / "fits"), "--save", str(fitted), *more,
    )  # fmt: skip
    about = result["parameters"][f"Body:{row.name}"]
    out = Path(result["folder"])
    found = native.image().read(str(out / about["files"][0]), as_linear=name not in (
        "roughness", "normal"
    ))[0]  # fmt: skip
    seen = native.image().read(str(out / about["files"][1]), as_linear=False)[0][..., 0] > _SEEN
    error = _error(name, found, truth(name, texels), seen) if name != "memory" else ""
    shown = photos / "unseen.exr"
    report_of(
        "render", str(fitted), "--camera", f"Camera {_CAMERAS - 1}", "--height",
        str(options.height), "--spp", "256", "--out", str(shown),
    )  # fmt: skip
    unseen = native.image().read(str(photos / f"{_CAMERAS - 1}.exr"))[0].astype(float)
    left = native.image().read(str(shown))[0].astype(float) - unseen
    decibel = 20 * math.log10(np.quantile(unseen, 0.9) / math.sqrt((left**2).mean()))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    return (
        f"| {name} | {texels} | {error} | {about['seen']:.0%} | {decibel:.1f} dB | "
        f"{result['iterations']} | {result['cpu_seconds']:.0f} | {peak:.2f} GiB |"
    )


def main() -> int:
    """Prints the table."""
    asked = argparse.ArgumentParser(prog="./dev bench maps", description=__doc__)
    asked.add_argument("rows", nargs="*", metavar="ROW", help=f"of {', '.join(ROWS)}")
    asked.add_argument("--height", type=int, default=128, help="of the photos (%(default)s)")
    asked.add_argument("--samples", type=int, default=256, help="of the photos (%(default)s)")
    asked.add_argument("--texels", type=int, help="along a side (256; of memory 2048)")
    asked.add_argument("--folder", help="kept, with its photos, which the next run takes")
    options, more = asked.parse_known_args()  # the rest goes to the fits
    rows = options.rows or list(ROWS)
    if unknown := sorted(set(rows) - set(ROWS)):
        asked.error(f"unknown rows: {', '.join(unknown)}")

    def row_of(name: str, folder: Path) -> str:
        if ROWS[name].cow and not DATA.exists():
            return f"| {name} | skipped: {DATA} is absent |"
        return examine(name, options, more, folder)

    header = "| row | texels | off by | seen | fifth photo | iterations | CPU s | peak |"
    print_rows(header, rows, row_of, options.folder)
    return 0


if __name__ == "__main__":
    status = main()
    sys.stderr.flush()
    os._exit(status)  # bpy may hang in its own destructors
