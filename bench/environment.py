# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench environment`: a body in a room whose light is unknown.

Cycles photographs a body from four sides under a panorama, on a ground of known colour or on none.
`selenite fit` starts from grey with colour, roughness and World:environment unknown. The table has
the fitted values, and how far a picture of the fitted body is from that of the true one under
another panorama, raw and after one factor. Panoramas: --rooms, a folder of EXR files.

--rotated: the panorama is known, but how it stood and the exposure are not. The table has the angle
and the strength that a fit of World:rotation,strength with the material has found.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "addon"))

from selenite import native  # noqa: E402
from selenite.fit.settings import PRESETS  # noqa: E402

_COLOUR, _ROUGHNESS, _GREY, _START = (0.6, 0.25, 0.1), 0.3, 0.5, 0.5
_VIEWS = ((-20, 25), (60, 35), (150, 20), (-110, 45))  # azimuth, elevation in degrees
#: How a known panorama stands: degrees about Z, and the world's strength.
_ANGLE, _EXPOSURE = 137.0, 1.8
_SEEN = 0.15  # change of a pixel, with its colour and gloss gone, from which on it shows the body


def photograph(folder: Path, room: str, other: str, ground: bool, size: int, rotated: bool) -> None:
    """In a process of its own: photos, true pictures under `other`, and the scene to fit. rotated:
    no pictures under `other`; the scene has the panorama, not as it stood."""
    import bpy
    from mathutils import Vector

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.cycles.samples, scene.cycles.blur_glossy = 512, 0
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    bpy.ops.mesh.primitive_monkey_add(size=1.6, location=(0, 0, 0.75))
    body = _material(bpy, "Body", _COLOUR, _ROUGHNESS)
    smooth = bpy.context.object.modifiers.new("Smooth", "SUBSURF")
    smooth.levels = smooth.render_levels = 2
    for polygon in bpy.context.object.data.polygons:
        polygon.use_smooth = True
    if ground:
        bpy.ops.mesh.primitive_plane_add(size=40)
        _material(bpy, "Ground", (_GREY,) * 3, 1.0)
    for index, (azimuth, elevation) in enumerate(_VIEWS):
        a, e = math.radians(azimuth - 90), math.radians(elevation)
        back = Vector((math.cos(a) * math.cos(e), math.sin(a) * math.cos(e), math.sin(e)))
        camera = bpy.data.objects.new(f"View {index}", bpy.data.cameras.new(f"View {index}"))
        scene.collection.objects.link(camera)
        camera.location = Vector((0, 0, 0.7)) + 4.2 * back
        camera.rotation_euler = back.to_track_quat("Z", "Y").to_euler()
    world = scene.world = bpy.data.worlds.new("World")
    world.use_nodes = True
    tree = world.node_tree
    image = tree.nodes.new("ShaderNodeTexEnvironment")
    link = tree.links.new(image.outputs["Color"], tree.nodes["Background"].inputs["Color"])
    sockets = body.inputs
    if rotated:
        mapping = tree.nodes.new("ShaderNodeMapping")
        coordinates = tree.nodes.new("ShaderNodeTexCoord")
        tree.links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
        tree.links.new(mapping.outputs["Vector"], image.inputs["Vector"])
        mapping.inputs["Rotation"].default_value[2] = math.radians(_ANGLE)
        tree.nodes["Background"].inputs["Strength"].default_value = _EXPOSURE

    def shoot(name: str, panorama: str) -> None:
        image.image = bpy.data.images.load(panorama)
        for index in range(len(_VIEWS)):
            scene.camera = bpy.data.objects[f"View {index}"]
            scene.render.filepath = str(folder / f"{name}{index}.exr")
            bpy.ops.render.render(write_still=True)

    shoot("photo", room)
    if rotated:
        tree.nodes.remove(mapping)
        tree.nodes["Background"].inputs["Strength"].default_value = 1
    else:
        shoot("true", other)
    result = folder / "fitted.json"
    if result.is_file():  # the second call: what the fit has found, and a black body
        values = json.loads(result.read_text(encoding="utf-8"))
        sockets["Base Color"].default_value = (*values["base_color"], 1)
        sockets["Roughness"].default_value = values["roughness"]
        shoot("fitted", other)
        sockets["Base Color"].default_value = (0, 0, 0, 1)
        sockets["Specular IOR Level"].default_value = 0
        shoot("black", other)
    sockets["Base Color"].default_value = (_START, _START, _START, 1)
    sockets["Roughness"].default_value = _START
    if not rotated:
        tree.links.remove(link)
        tree.nodes["Background"].inputs["Color"].default_value = (_START, _START, _START, 1)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "start.blend"))


def _material(bpy: Any, name: str, colour: tuple[float, ...], roughness: float) -> Any:  # noqa: ANN401
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    bpy.context.object.data.materials.append(material)
    node = material.node_tree.nodes["Principled BSDF"]
    node.inputs["Base Color"].default_value = (*colour, 1)
    node.inputs["Roughness"].default_value = roughness
    if name == "Ground":
        node.inputs["Specular IOR Level"].default_value = 0
    return node


def _child(*args: str) -> None:
    command = [sys.executable, __file__, "--photograph", *args]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def fitted(
    folder: Path, ground: bool, options: argparse.Namespace, more: list[str]
) -> dict[str, Any]:
    """The result of a fit of the body and of what `more` says."""
    fit = [
        sys.executable, "-m", "selenite", "fit", str(folder / "start.blend"), "--json",
        "--fit", "Body:base_color,roughness", *more, "--out", str(folder / "fits"),
        "--height", str(options.size), "--seed", str(options.seed), "--preset", options.preset,
    ]  # fmt: skip
    for index in range(len(_VIEWS)):
        fit += ["--photo", f"View {index}={folder}/photo{index}.exr"]
    fit += [] if ground else ["--silhouette", "1"]
    environment = os.environ | {"PYTHONPATH": str(ROOT / "addon")}
    done = subprocess.run(fit, check=True, capture_output=True, text=True, env=environment)
    return dict(json.loads(done.stdout.splitlines()[-1]))


def rotated_row(folder: Path, room: Path, options: argparse.Namespace) -> str:
    """A line of the table of known panoramas."""
    _child(str(folder), str(room), "", "1", str(options.size), "1")
    result = fitted(folder, True, options, ["--fit", "World:rotation,strength"])
    found = {name: item["value"] for name, item in result["parameters"].items()}
    colour = " ".join(f"{x:.3f}" for x in found["Body:base_color"])
    apart = math.degrees(math.remainder(found["World:rotation"] - math.radians(_ANGLE), math.tau))
    low, high = (math.degrees(x) for x in result["parameters"]["World:rotation"]["interval_90"])
    return (
        f"| {room.stem} | {options.seed} | {apart:+.3f} | {(high - low) / 2:.3f} "
        f"| {found['World:strength']:.3f} | {colour} | {found['Body:roughness']:.3f} "
        f"| {result['cpu_seconds']:.0f} |"
    )


def row(folder: Path, room: Path, other: Path, ground: bool, options: argparse.Namespace) -> str:
    """A line of the table."""
    known = str(int(ground))
    shots = (str(folder), str(room), str(other), known, str(options.size), "0")
    _child(*shots)
    more = ["--fit", "World:environment", "--environment-size", str(options.texels)]
    result = fitted(folder, ground, options, more)
    found = result["parameters"]
    values = {name: found[f"Body:{name}"]["value"] for name in ("base_color", "roughness")}
    (folder / "fitted.json").write_text(json.dumps(values), encoding="utf-8")
    _child(*shots)
    true, found_again, black = (
        np.concatenate([native.image().read(f"{folder}/{name}{i}.exr")[0] for i in range(4)])
        for name in ("true", "fitted", "black")
    )
    shown = np.abs(black - true).mean(axis=-1) > _SEEN * true.mean(axis=-1)
    a, b = found_again[shown], true[shown]
    factor = float((a * b).sum() / (a * a).sum())
    errors = [float(np.sqrt(((k * a - b) ** 2).sum() / (b**2).sum())) for k in (1, factor)]
    colour = " ".join(f"{x:.3f}" for x in values["base_color"])
    rough = found["Body:roughness"]
    note = "" if rough["determined"] else " (not determined)"
    return (
        f"| {room.stem} | {'known' if ground else 'none'} | {colour} | {rough['value']:.3f}{note} "
        f"| {100 * errors[0]:.1f} % | {100 * errors[1]:.1f} % | {result['cpu_seconds']:.0f} |"
    )


def main() -> int:
    """Prints the table."""
    if sys.argv[1:2] == ["--photograph"]:
        folder, room, other, ground, size, rotated = sys.argv[2:]
        photograph(Path(folder), room, other, ground == "1", int(size), rotated == "1")
        sys.stdout.flush()
        os._exit(0)  # bpy may hang in its own destructors
    asked = argparse.ArgumentParser(prog="./dev bench environment", description=__doc__)
    asked.add_argument("--rooms", type=Path, required=True, help="folder of two EXR files or more")
    asked.add_argument("--size", type=int, default=96, help="pixels of the photos (%(default)s)")
    asked.add_argument("--texels", type=int, default=512, help="of the light (%(default)s)")
    asked.add_argument("--ground", choices=("known", "none", "both"), default="both")
    asked.add_argument("--rotated", action="store_true", help="known panoramas that are rotated")
    asked.add_argument("--seed", type=int, default=0, help="of the fits (%(default)s)")
    asked.add_argument("--preset", choices=PRESETS, default="balanced", help="(%(default)s)")
    options = asked.parse_args()
    rooms = sorted(options.rooms.glob("*.exr"))
    print(f"truth: {_COLOUR}, roughness {_ROUGHNESS}")
    if options.rotated:
        print(f"{_ANGLE} degrees, strength {_EXPOSURE}")
        print("| room | seed | degrees off | interval +- | strength | colour | roughness | CPU s |")
        print("|---|---|---|---|---|---|---|---|")
        for room in rooms:
            with tempfile.TemporaryDirectory(prefix="selenite-environment-") as place:
                print(rotated_row(Path(place), room, options), flush=True)
        return 0
    print("| room | ground | colour | roughness | relit | after one factor | CPU s |")
    print("|---|---|---|---|---|---|---|")
    for index, room in enumerate(rooms):
        for ground in (True, False):
            if options.ground in ("both", "known" if ground else "none"):
                with tempfile.TemporaryDirectory(prefix="selenite-environment-") as place:
                    other = rooms[(index + 1) % len(rooms)]
                    print(row(Path(place), room, other, ground, options), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
