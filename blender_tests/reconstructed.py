# SPDX-License-Identifier: GPL-3.0-or-later
"""The reconstruction of scenes/reconstruction.py in every format, and where an imported scene shows
its points."""

import sys
from pathlib import Path

import bpy
import made_scenes as made
import numpy as np
from command_line import command

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "scenes"))

import reconstruction as pebble  # noqa: E402

FORMATS = ("metashape", "colmap text", "colmap binary", "transforms")


def written(folder, offset=(0.0, 0.0, 0.0), **how):
    """(reconstruction, words of `selenite import` by format), with photos of one grey."""
    found = pebble.build(offset, **how)
    (folder / "photos").mkdir(parents=True)
    for camera in found.cameras:
        made.photo(folder / "photos" / f"{camera.label}.exr", pebble.SIZE)
    return found, pebble.write_all(found, folder)


def imported(capsys, words, out):
    """The report of an import that has gone well."""
    status, report, said = command(capsys, "import", *words, "--save", str(out))
    assert status == 0, said
    assert report["saved"] == str(out) and out.is_file()
    return report


def opened(path):
    """The scene of a saved file, with its panel's settings: the add-on must be registered."""
    bpy.ops.wm.open_mainfile(filepath=str(path))
    return bpy.context.scene


def shown_at(scene, request, points):
    """(n, 2) pixels of the photo at which a capture has points (n, 3) of Blender's world, by the
    camera as it is read and by the lens as the fit undoes it."""
    from selenite.capture.distortion import distorted
    from selenite.capture.window import projection, window_of
    from selenite.scene_read.scene import read_scene

    camera = next(one for one in read_scene(scene).cameras if one.name == request.camera)
    problems = []
    window = window_of(camera, request, request.size, 1, problems)
    assert not problems
    seen = projection(camera, window)
    inside = np.linalg.inv(camera.matrix)
    places = points @ inside[:3, :3].T + inside[:3, 3]
    slopes = places[:, :2] / -places[:, 2:] * (1, -1)
    if request.distortion is not None:
        lens = request.distortion
        assert np.allclose([lens.fx, lens.fy], seen.focal, rtol=1e-6)
        assert np.allclose([lens.cx, lens.cy], seen.centre, atol=1e-4)
        return distorted(lens, slopes)
    return np.array(seen.centre) + np.array(seen.focal) * slopes


def vertices_of(item):
    """(n, 3) places in the world."""
    found = np.empty(len(item.data.vertices) * 3, np.float32)
    item.data.vertices.foreach_get("co", found)
    matrix = np.array(item.matrix_world, np.float64)
    return found.reshape(-1, 3).astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]


def everything():
    """Names of all that a file holds."""
    return sorted(f"{item.rna_type.identifier} {item.name}" for item in bpy.data.user_map())
