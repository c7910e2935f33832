# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench injected`: what faults of a photo shoot do to the values of a fit.

Cycles photographs a random opaque body from three sides. `selenite fit` finds its colour and
roughness from these photos, and from the same photos with a fault: exposure and white balance that
differ, another background, a camera that is off by pixels, a lamp that was not on. A row for each
fault and seed says by how much the values change, or by how much they are wrong.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import os
import random
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TextIO

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "blender_tests")]

import bpy  # noqa: E402
import made_scenes as made  # type: ignore[import-not-found]  # noqa: E402
from mathutils import Vector  # noqa: E402

from selenite import native  # noqa: E402
from selenite.cli import main as selenite  # noqa: E402
from selenite.cycles_check.render_settings import set_comparison  # noqa: E402

_PLACES = ((-1.2, -4.6, 1.6), (3.6, -3.2, 1.2), (-4.2, -1.6, 2.4))
#: Exposures of the three photos, and white balances beside these. Their geometric means are 1.
_EXPOSURES = (1.0, 0.5, 2.0)
_BALANCES = ((1, 1, 1), (1.2, 1, 0.8), (1 / 1.2, 1, 1.25))
_SHIFTS = ((2, 0), (0, -2), (-1.4, 1.4))  # pixels
_LAMPS = ("Key", "Fill")
Values = dict[str, Any]


class Shoot:
    """A body, its photos and the file to fit, in a folder. Colours and roughness go by the seed."""

    def __init__(self, folder: Path, seed: int, size: int, fit: Sequence[str]) -> None:
        draw = random.Random(seed)
        self.folder, self.size, self.fit_arguments = folder, size, [*fit, "--seed", str(seed)]
        self.truth = np.array([draw.uniform(0.15, 0.9) for _ in range(3)])
        self.roughness = draw.uniform(0.25, 0.6)
        self.scene = self._build()
        views = range(len(_PLACES))
        self.photos = [self._photograph(index) for index in views]
        #: Of cameras that stood beside where the scene has them.
        self.shifted = [self._photograph(index, shift=_SHIFTS[index]) for index in views]
        #: By the first camera under one lamp each.
        self.lit = [self._photograph(0, lamp=lamp) for lamp in _LAMPS]
        self.masks = [self._silhouette(index) for index in views]
        self._socket("base_color").default_value = (0.5, 0.5, 0.5, 1)
        self._socket("roughness").default_value = 0.5
        # A fit opens it here: what bpy holds now is gone after the first one.
        bpy.ops.wm.save_as_mainfile(filepath=str(folder / "start.blend"))

    def _socket(self, parameter: str) -> Any:  # noqa: ANN401
        return made.socket(bpy.data.materials["Body"], parameter)

    def _build(self) -> Any:  # noqa: ANN401
        bpy.ops.wm.read_factory_settings(use_empty=True)
        scene = bpy.context.scene
        scene.render.threads_mode, scene.render.threads = "FIXED", 1
        scene.render.image_settings.file_format = "OPEN_EXR"
        scene.render.image_settings.color_depth = "32"
        bpy.ops.mesh.primitive_monkey_add(size=2)
        body = bpy.context.object
        body.modifiers.new("Smooth", "SUBSURF").render_levels = 1
        for polygon in body.data.polygons:
            polygon.use_smooth = True
        body.data.materials.append(made.material("Body"))
        bpy.ops.mesh.primitive_plane_add(size=12, location=(0, 0, -1))
        bpy.context.object.data.materials.append(made.material("Floor", roughness=0.8))
        self._socket("base_color").default_value = (*self.truth, 1)
        self._socket("roughness").default_value = self.roughness
        for name, place in zip(_LAMPS, ((3, -3, 4), (-4, -2, 2)), strict=True):
            lamp = made.light(name, "AREA", energy=250, size=1.5)
            _stand(lamp, place)
            lamp.visible_camera = False
        for index, place in enumerate(_PLACES):
            _stand(made.camera(f"View {index}"), place)
        made.world(color=(0.05, 0.05, 0.05), strength=0.3)
        scene.render.resolution_x = scene.render.resolution_y = self.size
        set_comparison(scene, 256)
        return scene

    def _photograph(self, index: int, shift: Sequence[float] = (0, 0), lamp: str = "") -> Path:
        """With all lamps, or one of them alone and no world. shift: of the camera, in pixels."""
        path = self.folder / f"photo{len(list(self.folder.glob('photo*')))}.exr"
        self.scene.camera = bpy.data.objects[f"View {index}"]
        camera = self.scene.camera.data
        camera.shift_x, camera.shift_y = shift[0] / self.size, -shift[1] / self.size
        for name in _LAMPS:
            bpy.data.objects[name].hide_render = bool(lamp) and name != lamp
        background = self.scene.world.node_tree.nodes["Background"].inputs["Strength"]
        background.default_value = 0.0 if lamp else 0.3
        self.scene.render.filepath = str(path)
        bpy.ops.render.render(write_still=True)
        camera.shift_x = camera.shift_y = 0
        for name in _LAMPS:
            bpy.data.objects[name].hide_render = False
        background.default_value = 0.3
        return path

    def _silhouette(self, index: int) -> np.ndarray:
        """(h, w) booleans: pixels that show the body, and those next to them."""
        self._socket("emission_color").default_value = (1, 1, 1, 1)
        self._socket("emission_strength").default_value = 1e6
        seen = native.image().read(str(self._photograph(index)))[0][..., 0] > 1e3
        self._socket("emission_strength").default_value = 0.0
        shining = seen.copy()
        for axis, way in ((0, 1), (0, -1), (1, 1), (1, -1)):
            seen |= np.roll(shining, way, axis)
        return seen

    def changed(self, name: str, change: Any) -> list[Path]:  # noqa: ANN401
        """Copies of the photos; change(index, picture) gives the new picture."""
        found = []
        for index, photo in enumerate(self.photos):
            picture = change(index, native.image().read(str(photo))[0][..., :3])
            path = self.folder / f"{name}{index}.exr"
            native.image().write_exr(str(path), np.ascontiguousarray(picture, np.float32))
            found.append(path)
        return found

    def fitted(self, photos: Sequence[Path], *more: str, **keys: Sequence[Any]) -> Values:
        """result.json of a fit. keys: of the captures, a value for each photo."""
        rows = [{"camera": f"View {index}", "photo": str(p)} for index, p in enumerate(photos)]
        for key, values in keys.items():
            for row, value in zip(rows, values, strict=True):
                row[key] = value
        captures = self.folder / "captures.json"
        captures.write_text(json.dumps({"schema": 1, "captures": rows}), encoding="utf-8")
        words = [
            "fit", str(self.folder / "start.blend"), "--json", "--fit", "Body:base_color,roughness",
            "--captures", str(captures), "--height", str(self.size), "--picture-spp", "1",
            "--out", str(self.folder / "fits"), *self.fit_arguments, *more,
        ]  # fmt: skip
        out, log = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(log):
            status = selenite(words)
        if status:
            raise RuntimeError(f"{photos[0].stem}: {log.getvalue()}")
        result: Values = json.loads(out.getvalue().strip().splitlines()[-1])
        return result


def _stand(item: Any, place: Sequence[float]) -> None:  # noqa: ANN401
    item.location = place
    item.rotation_euler = (-Vector(place)).to_track_quat("-Z", "Y").to_euler()


def _found(result: Values) -> tuple[np.ndarray, float]:
    parameters = result["parameters"]
    return (
        np.array(parameters["Body:base_color"]["value"]),
        float(parameters["Body:roughness"]["value"]),
    )


def _change(result: Values, plain: Values) -> tuple[float, float]:
    """Largest relative change of a colour, and that of the roughness."""
    (colour, rough), (colour0, rough0) = _found(result), _found(plain)
    return float(np.abs(colour / colour0 - 1).max()), abs(rough / rough0 - 1)


def _contained(result: Values, shoot: Shoot) -> str:
    """How many of the 90 % intervals hold the truth; those of nothing determined do."""
    truth = {"Body:base_color": shoot.truth.tolist(), "Body:roughness": [shoot.roughness]}
    hold = 0
    for name, values in truth.items():
        intervals = result["parameters"][name]["interval_90"]
        intervals = [intervals] if name == "Body:roughness" else intervals or [None] * 3
        hold += sum(i is None or i[0] <= v <= i[1] for i, v in zip(intervals, values, strict=True))
    return f"{hold} of 4"


def examine(shoot: Shoot, seed: int, table: TextIO) -> None:
    """Writes the rows of one body."""

    def add(fault: str, text: str) -> None:
        print(f"| {seed} | {fault} | {text} |", file=table, flush=True)

    def compare(fault: str, result: Values, plain: Values) -> None:
        colour, rough = _change(result, plain)
        text = f"colour {colour:.2%}, roughness {rough:.2%} off the undisturbed fit"
        add(fault, f"{text}; {_contained(result, shoot)} intervals hold the truth")

    plain = shoot.fitted(shoot.photos)
    colour, rough = _found(plain)
    error = float(np.abs(colour / shoot.truth - 1).max())
    text = f"colour {error:.2%}, roughness {abs(rough / shoot.roughness - 1):.2%} off the truth"
    add("none", f"{text}; {_contained(plain, shoot)} intervals hold the truth")

    exposed = shoot.changed("exposed", lambda i, picture: picture * _EXPOSURES[i])
    gain = ["none", "scalar", "scalar"]
    compare("exposure .5 to 2, one photo known", shoot.fitted(exposed, gain=gain), plain)
    compare("the same, none known", shoot.fitted(exposed, gain=["scalar"] * 3), plain)
    balanced = shoot.changed(
        "balanced", lambda i, picture: picture * np.array(_BALANCES[i]) * _EXPOSURES[i]
    )
    gain = ["none", "rgb", "rgb"]
    compare("and white balance 20 %, one photo known", shoot.fitted(balanced, gain=gain), plain)
    compare("the same, none known", shoot.fitted(balanced, gain=["rgb"] * 3), plain)

    masked = shoot.fitted(shoot.photos, silhouette=[1] * 3)
    noise = np.random.default_rng(seed)
    for name, background in (
        ("black", lambda picture: 0 * picture),
        ("white", lambda picture: 0 * picture + picture.max()),
        ("noise", lambda picture: noise.uniform(0, picture.max(), picture.shape)),
    ):
        photos = shoot.changed(
            name, lambda i, p, b=background: np.where(shoot.masks[i][..., None], p, b(p))
        )
        compare(f"{name} background, silhouette", shoot.fitted(photos, silhouette=[1] * 3), masked)

    for name, photos, align in (
        ("aligned photos, --align", shoot.photos, True),
        ("2 pixels off", shoot.shifted, False),
        ("2 pixels off, --align", shoot.shifted, True),
    ):
        result = shoot.fitted(photos, align=[align] * 3)
        error = float(np.abs(_found(result)[0] / shoot.truth - 1).mean())
        shifts = [v.get("shift") for v in result["captures"].values()]
        text = f"colour {error:.2%} off the truth; shifts found {_rounded(shifts)}"
        add(name, f"{text}; {_contained(result, shoot)} intervals hold")

    for name, lamps in (("lamps as they were", _LAMPS), ("lamps exchanged", _LAMPS[::-1])):
        result = _under_lamps(shoot, lamps)
        named = [line for line in result["warnings"] if "check the lights of this" in line]
        error = float(np.abs(_found(result)[0] / shoot.truth - 1).max())
        add(name, f"colour {error:.2%} off the truth; photos named: {len(named)} of 2")


def _under_lamps(shoot: Shoot, lamps: Sequence[str]) -> Values:
    """A fit to the two photos of the first camera, which says that these lamps were on."""
    return shoot.fitted(
        shoot.lit, camera=["View 0"] * 2, lights=[[lamp] for lamp in lamps], world=[False] * 2
    )


def _rounded(shifts: Sequence[Any]) -> str:
    return " ".join("-" if s is None else f"({float(s[0]):.1f}, {float(s[1]):.1f})" for s in shifts)


def main() -> int:
    """Prints the table."""
    asked = argparse.ArgumentParser(prog="./dev bench injected", description=__doc__)
    asked.add_argument("--size", type=int, default=64, help="pixels of the photos (%(default)s)")
    asked.add_argument("--seeds", type=int, default=4, help="bodies (%(default)s)")
    asked.add_argument("--first-seed", type=int, default=0)
    options, fit = asked.parse_known_args()  # the rest goes to the fits
    table = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8")
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # what Blender prints
    print("| seed | fault | what the fit makes of it |\n|---|---|---|", file=table)
    for seed in range(options.first_seed, options.first_seed + options.seeds):
        with tempfile.TemporaryDirectory(prefix="selenite-injected-") as place:
            examine(Shoot(Path(place), seed, options.size, fit), seed, table)
    return 0


if __name__ == "__main__":
    status = main()
    sys.stderr.flush()
    os._exit(status)  # bpy may hang in its own destructors
