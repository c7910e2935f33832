# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench scale [AXIS ...]`: how a fit's time and memory grow with what it is given.

A body before a lamp is fitted for six steps and refined, in a process of its own for each size of
an axis: cameras, pixels, triangles, scalars, texels, voxels. Prints CPU seconds of the fit and of
the whole command, and the largest resident memory. *bend*: seconds for each unit more from the
second size to the third, over those from the first to the second; above 1 the time grows faster
than linearly. Results are kept in the output folder and are not measured again.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import shutil
import subprocess
import sys
from dataclasses import asdict, dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "addon")]

_SCALARS = (
    "roughness", "base_color", "metallic", "ior", "alpha", "specular_level", "specular_tint",
    "coat_weight", "coat_roughness", "coat_tint", "sheen_weight",
)  # fmt: skip
_CHANNELS = {"base_color": 3, "specular_tint": 3, "coat_tint": 3}


@dataclass(frozen=True)
class Size:
    """Of a fit. height: of the photos. segments: of the body. texels, voxels: along a side, 0 for
    none."""

    cameras: int = 2
    height: int = 96
    segments: int = 64
    scalars: int = 4
    texels: int = 0
    voxels: int = 0

    def fitted(self) -> tuple[str, ...]:
        if self.voxels:
            name = "Body:albedo_grid"
            return (f"--fit={name}", f"--grid={name}={self.voxels}")
        if self.texels:
            name = "Body:base_color_texture"
            return (f"--fit={name}", f"--grid={name}={self.texels}")
        names, left = [], self.scalars
        for name in _SCALARS:
            if left < (width := _CHANNELS.get(name, 1)):
                continue
            names.append(name)
            left -= width
        return (f"--fit=Body:{','.join(names)}",)


#: Of an axis: the sizes, and how many units each has.
AXES: dict[str, tuple[tuple[Size, float], ...]] = {
    "cameras": tuple((Size(cameras=n), n) for n in (1, 4, 16)),
    "pixels": tuple((Size(height=n), n**2) for n in (64, 256, 1024)),
    "triangles": tuple((Size(segments=n), n * n) for n in (32, 192, 1140)),
    "scalars": tuple((Size(scalars=n), n) for n in (1, 4, 16)),
    "texels": tuple((Size(texels=n, height=256), n**2) for n in (128, 512, 2048)),
    "voxels": tuple((Size(voxels=n, segments=32), n**3) for n in (8, 24, 64)),
}


def make_scene(size: Size, path: Path) -> None:
    """In a process of its own: cameras around a body that is smoke where it has voxels."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x = scene.render.resolution_y = size.height
    bpy.ops.mesh.primitive_uv_sphere_add(segments=size.segments, ring_count=size.segments // 2)
    body = bpy.context.object
    body.data.polygons.foreach_set("use_smooth", [True] * len(body.data.polygons))
    made = bpy.data.materials.new("Body")
    made.use_nodes = True
    tree = made.node_tree
    surface = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
    surface.inputs["Base Color"].default_value = (0.6, 0.4, 0.3, 1.0)
    surface.inputs["Roughness"].default_value = 0.4
    if size.texels:
        image = bpy.data.images.new("Body", size.texels, size.texels)
        image.generated_color = (0.6, 0.4, 0.3, 1.0)
        image.pack()
        texture = tree.nodes.new("ShaderNodeTexImage")
        texture.image = image
        tree.links.new(texture.outputs["Color"], surface.inputs["Base Color"])
    if size.voxels:
        tree.nodes.remove(surface)
        smoke = tree.nodes.new("ShaderNodeVolumePrincipled")
        smoke.inputs["Density"].default_value = 2.0
        smoke.inputs["Color"].default_value = (0.6, 0.5, 0.4, 1.0)
        output = tree.get_output_node("CYCLES")
        tree.links.new(smoke.outputs[0], output.inputs["Volume"])
    body.data.materials.append(made)
    for index in range(size.cameras):
        turn = 2 * math.pi * index / size.cameras
        camera = bpy.data.objects.new(f"Camera {index}", bpy.data.cameras.new("Camera"))
        camera.location = (4 * math.sin(turn), -4 * math.cos(turn), 0.0)
        camera.rotation_euler = (math.pi / 2, 0.0, turn)
        scene.collection.objects.link(camera)
        scene.camera = camera
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "AREA"))
    lamp.data.energy, lamp.data.size, lamp.location = 400.0, 2.0, (0.0, 0.0, 4.0)
    scene.collection.objects.link(lamp)
    world = bpy.data.worlds.new("World")
    world.use_nodes = True
    scene.world = world
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


def _run(command: list[str]) -> str:
    """Standard output. Raises RuntimeError with the end of what it said of its failure."""
    environment = os.environ | {"PYTHONPATH": str(ROOT / "addon")}
    done = subprocess.run(
        [sys.executable, *command], env=environment, capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise RuntimeError(f"{' '.join(command[:3])} failed: {done.stderr[-600:]}")
    return done.stdout


def measure(size: Size, threads: int, folder: Path) -> dict[str, float]:
    """fit, command: CPU seconds. memory: MiB."""
    folder.mkdir(parents=True, exist_ok=True)
    kept = folder / "measured.json"
    if kept.exists():
        found: dict[str, float] = json.loads(kept.read_text())
        return found
    scene = folder / "scene.blend"
    _run([__file__, "--make", json.dumps(asdict(size)), str(scene)])
    plain = ["Body:base_color=0.7,0.5,0.2"] if not (size.texels or size.voxels) else []
    photos = []
    for index in range(size.cameras):
        photo = folder / f"{index}.exr"
        values = [word for value in plain for word in ("--set", value)]
        _run(["-m", "selenite", "render", str(scene), f"--camera=Camera {index}",
              f"--out={photo}", "--spp=16", f"--seed={9000 + index}", *values])  # fmt: skip
        photos.append(f"--photo=Camera {index}={photo}")
    shutil.rmtree(folder / "fits", ignore_errors=True)  # of a run that was stopped
    words = ["fit", str(scene), *size.fitted(), *photos, f"--out={folder / 'fits'}", "--json",
             f"--height={size.height}", "--iterations=6", "--spp=4", "--search=off",
             "--precision=exact", "--stages=none", "--picture-spp=1",
             f"--threads={threads}"]  # fmt: skip
    found = json.loads(_run([__file__, "--meter", *words]))
    kept.write_text(json.dumps(found))
    return found


def meter(words: list[str]) -> int:
    """Runs the fit as its only child, whose memory and CPU time the system then has."""
    import resource

    done = subprocess.run(
        [sys.executable, "-m", "selenite", *words], capture_output=True, text=True, check=False
    )
    if done.returncode:
        print(done.stdout, done.stderr, file=sys.stderr)
        return done.returncode
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    (result,) = Path(next(w for w in words if w.startswith("--out="))[6:]).glob("*/result.json")
    fit = json.loads(result.read_text())
    print(json.dumps({
        "fit": fit["cpu_seconds"], "command": used.ru_utime + used.ru_stime,
        "memory": used.ru_maxrss / 1024,
    }))  # fmt: skip
    return 0


def main() -> int:
    if sys.argv[1:2] == ["--make"]:
        make_scene(Size(**json.loads(sys.argv[2])), Path(sys.argv[3]))
        return 0
    if sys.argv[1:2] == ["--meter"]:
        return meter(sys.argv[2:])
    parser = argparse.ArgumentParser(prog="./dev bench scale", description=__doc__)
    parser.add_argument("axes", nargs="*", metavar="AXIS", help=", ".join(AXES))
    parser.add_argument("--threads", type=int, default=1, help="(%(default)s)")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "scale", help="(%(default)s)")
    options = parser.parse_args()
    if unknown := set(options.axes) - set(AXES):
        raise SystemExit(f"there is no axis {', '.join(sorted(unknown))}; only {', '.join(AXES)}")
    print("| axis | units | fit, CPU s | command, CPU s | memory, MiB | bend |")
    print("|---|---|---|---|---|---|", flush=True)
    for axis in options.axes or AXES:
        costs: list[tuple[float, float]] = []
        for size, units in AXES[axis]:
            one = measure(size, options.threads, options.out / f"{axis}-{units:.0f}")
            costs.append((units, one["fit"]))
            print(
                f"| {axis} | {units:.3g} | {one['fit']:.2f} | {one['command']:.1f} "
                f"| {one['memory']:.0f} | {bend(costs)} |", flush=True,
            )  # fmt: skip
    return 0


def bend(costs: list[tuple[float, float]]) -> str:
    """Of three sizes; empty for fewer."""
    if len(costs) < 3:
        return ""
    slopes = [(c2 - c1) / (u2 - u1) for (u1, c1), (u2, c2) in zip(costs, costs[1:], strict=False)]
    return f"{slopes[1] / slopes[0]:.2f}" if slopes[0] > 0 else "-"


if __name__ == "__main__":
    sys.exit(main())
