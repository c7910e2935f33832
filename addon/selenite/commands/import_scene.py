# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite import`: from a reconstruction to a .blend file that a fit takes as it is."""

from __future__ import annotations

import argparse
import json
import math
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..capture.request import MOST_ERODED, PACKED
from ..paths import absolute, is_folder
from ..problems import Problem
from .arguments import input_file, output_file, stop_if
from .grouping import grouped
from .terminal import bar, say, say_saved

if TYPE_CHECKING:
    from ..importers.plan import ImportPlan, ImportRequest
    from ..importers.reconstruction import PackedPicture
    from ..importers.to_blender import Created
    from ..json_text import JsonObject

_FILE = "give a file of a reconstruction; see selenite import --help"


def run(args: argparse.Namespace) -> dict[str, object]:
    """Reads, makes a new scene of it, and saves that. Nothing is written if anything is wrong."""
    problems: list[Problem] = []
    save = output_file(args.save, (".blend",), problems)
    given = _request(args, problems)
    stop_if(problems)
    import bpy

    from ..cycles_check.render_settings import set_for_fit
    from ..importers import to_blender, undistorted
    from ..importers.plan import make_plan
    from ..importers.sources import read_any
    from . import addon_settings

    addon_settings.make_known()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    assert scene is not None  # noqa: S101 - an empty file has one
    folder = save.with_name(f"{save.stem}_photos")
    with bar("importing") as shown, undistorted.taken_back(folder):

        def note(text: str, fraction: float) -> None:
            shown.update(fraction, note=text)

        plan = make_plan(given, read_any, note)
        to_blender.show_as_photos(plan, scene)
        if args.undistort:
            plan = undistorted.write_photos(plan, folder, note)
        made = to_blender.create(plan, scene, note)
        to_blender.add_white_world(scene)
        set_for_fit(scene)
        to_blender.relative_paths(scene, save.parent)
        kept = _save(save)
    report = _report(plan, save, made)
    _say(report, args.undistort, kept)
    return report


def _request(args: argparse.Namespace, problems: list[Problem]) -> ImportRequest:
    from ..importers.plan import ImportRequest

    distance = None
    if args.scale_points is not None:
        first, second, text = args.scale_points
        distance = (first, second, _length("--scale-points", text, problems))
    if args.scale is not None:
        _length("--scale", args.scale, problems)
    if args.silhouette is not None and not 0 <= args.silhouette <= MOST_ERODED:
        cure = f"give a number of pixels from 0 to {MOST_ERODED}"
        problems.append(Problem("Argument --silhouette", f"it is {args.silhouette}", cure))
    given: dict[str, object] = {
        "cameras": _source(args.cameras, problems) if args.cameras is not None else None,
        "photos": _folder("--photos", args.photos, problems),
        "masks": _folder("--masks", args.masks, problems),
        "meters": args.scale,
        "known_distance": distance,
        "ground": tuple(args.ground) if args.ground is not None else None,
        "up": args.up,
        "silhouette": args.silhouette,
    }
    return ImportRequest(_source(args.file, problems), **given)


def _source(text: str, problems: list[Problem]) -> Path:
    """A file, or a folder with files of a reconstruction."""
    path = absolute(text)
    return path if is_folder(path) else input_file(text, problems, _FILE)


def _length(argument: str, value: str | float, problems: list[Problem]) -> float:
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not 0 < number < math.inf:
        cure = "give metres, a number above 0"
        problems.append(Problem(f"Argument {argument}", f"its length is {value}", cure))
        return 1.0
    return number


def _folder(argument: str, text: str | None, problems: list[Problem]) -> Path | None:
    if text is None:
        return None
    path = absolute(text)
    if not is_folder(path):
        cure = "give a folder that exists"
        problems.append(Problem(f"Argument {argument} '{text}'", "it is no folder", cure))
    return path


def _save(path: Path) -> str:
    """Blender writes beside `path` and renames. Returns the new name of a file that was there, or
    "". Raises BadInput."""
    import bpy

    from ..scene_read.blend_file import whole_blend
    from ..write_back import replaced_file_kept

    with replaced_file_kept(str(path)) as kept, whole_blend(str(path), "give another"):
        bpy.ops.wm.save_as_mainfile(
            filepath=str(path), check_existing=False, relative_remap=False, compress=False
        )
    return kept


def _report(plan: ImportPlan, save: Path, made: Created) -> JsonObject:
    return {
        "saved": str(save),
        "name": plan.name,
        "cameras": [
            {
                "name": item.name,
                "label": item.label,
                "width": item.intrinsics.width,
                "height": item.intrinsics.height,
                "photo": item.capture.photo if item.capture is not None else None,
                "mask": (item.capture.mask or None) if item.capture is not None else None,
                "distorted": item.intrinsics.distorted,
            }
            for item in plan.cameras
        ],
        "captures": made.captures,
        "cameras_without_photo": list(plan.without_photo),
        "photos_without_camera": list(plan.without_camera),
        "meshes": [
            {
                "name": item.name,
                "vertices": len(item.positions),
                "triangles": len(item.triangles),
                "materials": [
                    {"name": material.name, "texture": _texture(one.texture)}
                    | ({"times_colors": True} if one.times_colors else {})
                    for one, material in zip(item.materials, materials, strict=True)
                ],
            }
            for item, materials in zip(plan.meshes, made.materials, strict=True)
        ],
        "points": len(plan.points),
        "size_m": [float(value) for value in plan.size],
        "meters_per_unit": plan.placement.scale,
        "offset": [float(value) for value in plan.placement.offset],
        "world_to_file": plan.placement.to_file().tolist(),
        "warnings": list(plan.warnings),
    }


def _texture(texture: Path | PackedPicture | None) -> str | None:
    if texture is None:
        return None
    return str(texture) if isinstance(texture, Path) else f"{PACKED}{texture.name}"


def _say(report: JsonObject, undistort: bool, kept: str) -> None:
    size = f"; {_lengths(report['size_m'])}" if any(report["size_m"]) else ""
    cameras = len(report["cameras"])
    say(f"'{report['name']}': cameras: {cameras}, with a photo: {report['captures']}{size}")
    for mesh in report["meshes"]:
        counts = f"{mesh['vertices']} vertices, {mesh['triangles']} triangles"
        textures = [one["texture"] for one in mesh["materials"] if one["texture"]]
        shown = "".join(f"; texture {texture}" for texture in textures)
        say(f"mesh '{mesh['name']}': {counts}{shown}")
    if any(item["distorted"] for item in report["cameras"]) and not undistort:
        say("the lens distorts the photos; a fit undoes it, Blender's background images do not")
    for text in grouped(report["warnings"]):
        say(f"warning: {text}")
    say("light: an even white world of strength 1 stands in; set or fit your own")
    say_saved(report["saved"], kept)
    if report["captures"] and report["meshes"]:
        file = shlex.quote(report["saved"])
        say(f"next: selenite check {file}")
        say(f"then: selenite fit {file} {' '.join(_usual(report['meshes']))}")


def _usual(meshes: Sequence[JsonObject]) -> list[str]:
    """What of each material is usually fitted first, as words of the command line."""
    found: dict[str, None] = {}
    for material in (one for mesh in meshes for one in mesh["materials"]):
        name = material["name"]
        if any(letter in name for letter in '=:,"\n') or name.startswith("-"):
            name = json.dumps(name, ensure_ascii=False)
        parameters = "base_color_texture" if material["texture"] else "base_color,roughness"
        if material.get("times_colors"):  # the base colour is a product of two
            parameters = "Principled BSDF.Roughness"
        found[f"--fit {shlex.quote(f'{name}:{parameters}')}"] = None
    return list(found)


def _lengths(size: Sequence[float]) -> str:
    return f"size {' x '.join(f'{value:.4g}' for value in size)} m"
