# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the Principled BSDF in small scenes, rendered natively and by Cycles on the spot."""

import math
from dataclasses import dataclass, field
from pathlib import Path

import bpy
import made_scenes as made
import mathutils
import numpy as np

from selenite import native, parameters
from selenite.cycles_check.compare import Estimate, Verdict, judge
from selenite.cycles_check.render import render
from selenite.problems import BadInput
from selenite.scene_read.blend_file import open_blend
from selenite.scene_read.build import build
from selenite.scene_read.scene import read_scene

CHECK_SCENES = Path(__file__).resolve().parents[2] / "shared" / "check" / "cycles"
ORANGE, TEAL, WHITE, BLACK = (0.8, 0.5, 0.3), (0.2, 0.6, 0.7), (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Case:
    """One material in one scene. `fast`: in the subset that `./dev test` runs."""

    name: str
    scene: str
    values: dict = field(default_factory=dict)
    distribution: str = "MULTI_GGX"
    fast: bool = False


def _glass(**values):
    return {"base_color": ORANGE, "transmission": 1.0, **values}


def _cases():
    def lamp(name, fast=False, distribution="MULTI_GGX", **values):
        values = {"base_color": ORANGE, "roughness": 0.3, **values}
        return Case(name, "lamp", values, distribution, fast)

    def sky(name, fast=False, **values):
        return Case(f"sky: {name}", "sky", {"base_color": ORANGE, **values}, fast=fast)

    def sun(name, **values):
        return Case(f"sun: {name}", "sun", {"base_color": ORANGE, **values})

    mixed = {"metallic": 0.3, "transmission": 0.4, "coat_weight": 0.6, "coat_tint": TEAL}
    mixed |= {"diffuse_roughness": 0.5, "specular_tint": TEAL, "alpha": 0.8, "ior": 1.7}
    return [
        *(
            lamp(f"roughness {r:g}", r in (0.0, 0.3), roughness=r)
            for r in (0, 0.02, 0.1, 0.3, 0.7, 1)
        ),
        lamp("roughness .7, GGX", distribution="GGX", roughness=0.7),
        lamp("black", base_color=BLACK),
        lamp("white", True, base_color=WHITE, roughness=1.0),
        *(lamp(f"metallic 1, roughness {r:g}", metallic=1.0, roughness=r) for r in (0, 0.1, 0.3)),
        lamp("metallic 1, roughness .7", True, metallic=1.0, roughness=0.7),
        lamp("metallic 1, roughness .7, GGX", distribution="GGX", metallic=1.0, roughness=0.7),
        lamp("metallic 1, tinted edge", metallic=1.0, specular_tint=TEAL),
        lamp("metallic .5", metallic=0.5),
        *(
            lamp(f"glass, roughness {r:g}", r in (0, 0.3), **_glass(roughness=r))
            for r in (0, 0.02, 0.1, 0.3, 0.5, 0.7, 1)
        ),
        lamp("glass, roughness .5, GGX", distribution="GGX", **_glass(roughness=0.5)),
        lamp("white glass, roughness .3", **_glass(base_color=WHITE)),
        lamp("black glass, roughness .3", **_glass(base_color=BLACK)),
        lamp("glass, tinted reflection", **_glass(specular_tint=TEAL, roughness=0.1)),
        *(lamp(f"glass, IOR {n:g}", **_glass(ior=n, roughness=0.1)) for n in (0.8, 1, 1.33, 2.4)),
        *(lamp(f"opaque, IOR {n:g}", ior=n) for n in (0.8, 1, 1.33, 2.4)),
        lamp("transmission .5", True, transmission=0.5, roughness=0.2),
        lamp("transmission .5, roughness .7", transmission=0.5, roughness=0.7),
        lamp("specular level 0", specular_level=0.0),
        lamp("specular level 1", specular_level=1.0),
        lamp("specular tint", specular_level=1.0, specular_tint=TEAL),
        lamp("coat, tinted", True, coat_weight=1.0, coat_roughness=0.1, coat_tint=TEAL),
        lamp("coat .5, IOR 1.8, rough", coat_weight=0.5, coat_roughness=0.4, coat_ior=1.8),
        lamp("coat on metal", metallic=1.0, coat_weight=1.0, coat_roughness=0.0),
        lamp("alpha .5", True, alpha=0.5),
        lamp("emission", emission_color=TEAL, emission_strength=2.0),
        lamp("emission under a coat", coat_weight=1.0, emission_color=TEAL, emission_strength=2.0),
        lamp("diffuse roughness .5", diffuse_roughness=0.5),
        lamp("diffuse roughness 1", diffuse_roughness=1.0, roughness=1.0),
        lamp("everything mixed", True, **mixed),
        lamp("everything mixed, GGX", distribution="GGX", **mixed),
        sky("opaque", roughness=0.3),
        sky("metallic 1, roughness .2", True, metallic=1.0, roughness=0.2),
        *(
            sky(f"glass, roughness {r:g}", r == 0, **_glass(roughness=r))
            for r in (0, 0.1, 0.3, 0.7)
        ),
        sky("transmission .5, roughness .3", transmission=0.5, roughness=0.3),
        # Under a lamp Cycles sees its image through the body by a few samples of huge weight.
        sky("alpha .5 glass", **_glass(alpha=0.5, roughness=0.1)),
        sky("coat, tinted", coat_weight=1.0, coat_roughness=0.1, coat_tint=TEAL),
        sky("everything mixed", **mixed),
        sun("opaque", roughness=0.3),
        sun("metallic 1, roughness .3", metallic=1.0, roughness=0.3),
        sun("glass, roughness .3", **_glass(roughness=0.3)),
        sun("glass, roughness .7", **_glass(roughness=0.7)),
        sun("coat, tinted", coat_weight=1.0, coat_roughness=0.2, coat_tint=TEAL),
    ]


CASES = _cases()
CHECKED = ("scene01_opaque", "scene02_metal", "scene03_glass_smooth", "scene05_half")
CHECKED += ("scene06_volume_glass", "scene08_lights_texture", "scene12_camera_shift")


def material_of(case):
    """A Principled material with the values of a case; names are those of the parameter table."""
    made_material = made.material("Body")
    node = made.principled(made_material)
    node.distribution = case.distribution
    table = {parameter.name: parameter for parameter in parameters.of("material")}
    values = {"emission_strength": 0.0, **case.values}
    for name, value in values.items():
        socket = table[name].find(node)
        wide = isinstance(value, tuple)
        if wide:
            socket.default_value = (*value, 1.0) if len(socket.default_value) == 4 else value
        else:
            socket.default_value = value
    return made_material


def make(case, size, segments=48):
    """Replaces the open file by the scene of a case, rendered at size x size pixels."""
    made.open_empty_file()
    body = made.sphere(material=material_of(case), segments=segments)
    for vertex in body.data.vertices:
        x, y, z = vertex.co
        vertex.co *= 1 + 0.06 * math.sin(5 * x + 1) * math.sin(4 * y) * math.cos(5 * z)
    body.data.update()
    camera = made.camera(lens=50)
    camera.location = (0.6, -4.2, 1.9)
    towards = mathutils.Vector((0, 0, -0.1)) - camera.location
    camera.rotation_euler = towards.to_track_quat("-Z", "Y").to_euler()
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = size
    if case.scene == "sky":
        world = made.world()
        made.environment(world, _sky())
        return
    bpy.ops.mesh.primitive_plane_add(size=9, location=(0, 0, -1.08))
    ground = made.material("Ground", base_color=(0.45, 0.4, 0.35), roughness=0.9)
    bpy.context.object.data.materials.append(ground)
    made.world((0.5, 0.56, 0.66), strength=0.4)
    if case.scene == "lamp":
        lamp = made.light("Lamp", "AREA", energy=120, size=1.5)
        lamp.location = (1.6, -1.8, 2.6)
    else:
        lamp = made.light("Lamp", "SUN", energy=2.0, angle=0.0)
        lamp.location = (1.6, -0.9, 2.6)
    lamp.rotation_euler = (-lamp.location).to_track_quat("-Z", "Y").to_euler()


def _sky():
    """(32, 64, 3): a bright spot of peak 8 above a dim gradient; a little below 0 at the bottom, as
    resampled pictures are, those that Blender brings along too."""
    v, u = np.meshgrid((np.arange(32) + 0.5) / 32, (np.arange(64) + 0.5) / 64, indexing="ij")
    height, turn = math.pi * (0.5 - v), 2 * math.pi * (0.5 - u)
    around = [np.cos(height) * np.cos(turn), np.cos(height) * np.sin(turn), np.sin(height)]
    spot = np.array([0.55, -0.5, 0.67]) / np.linalg.norm([0.55, -0.5, 0.67])
    cosine = np.clip(np.tensordot(spot, np.stack(around), 1), 0, 1)
    dim = 0.15 + 0.35 * (1 - v)
    colour = np.array([0.7, 0.85, 1.0])
    bright = 8 * cosine[..., None] ** 30 * np.array([1.0, 0.9, 0.75])
    sky = (dim[..., None] * colour + bright).astype(np.float32)
    sky[-4:] = -0.003
    return sky


def mask_of(name="Body"):
    """(h, w) bool: pixels whose centre shows the object first."""
    scene = bpy.context.scene
    view = bpy.context.view_layer
    view.update()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    camera = scene.camera
    width, height = scene.render.resolution_x, scene.render.resolution_y
    corners = [mathutils.Vector(corner) for corner in camera.data.view_frame(scene=scene)]
    right, top = max(c.x for c in corners), max(c.y for c in corners)
    matrix, origin = camera.matrix_world.to_3x3(), camera.matrix_world.translation
    found = np.zeros((height, width), bool)
    for row in range(height):
        for column in range(width):
            x = right * (2 * (column + 0.5) / width - 1)
            y = top * (1 - 2 * (row + 0.5) / height)
            direction = matrix @ mathutils.Vector((x, y, corners[0].z))
            hit, *_, item, _ = scene.ray_cast(depsgraph, origin, direction)
            found[row, column] = hit and item.name == name
    return found


def check_scene(name, size):
    """Opens one of the check scenes at size x size pixels; returns its mask, or None if it is not
    beside this checkout."""
    path = CHECK_SCENES / f"{name}.blend"
    if not path.is_file():
        return None
    scene = open_blend(str(path))
    scene.render.resolution_x = scene.render.resolution_y = size
    mask = native.image().read(str(path.with_name(f"{name}_mask.exr")))[0]
    small = native.image().resize(np.ascontiguousarray(mask), size, size)
    return small[..., 0] > 0.99


@dataclass(frozen=True)
class Effort:
    """Rounds of `seeds` renders by Cycles with `samples` each and one native render, until the
    standard deviation of the bias is at most `noise`; the rule never looks at the bias itself."""

    samples: int = 64
    seeds: int = 8
    native_samples: int = 512
    noise: float = 0.0025
    rounds: int = 5


def compare(mask, folder, effort):
    """(verdict, our picture, Cycles') of the open scene; raises BadInput where we cannot render."""
    scene = bpy.context.scene
    values = read_scene(scene)
    if values.problems:
        raise BadInput(values.problems)
    size = (scene.render.resolution_x, scene.render.resolution_y)
    camera, ready = scene.camera.name, build(values)
    films, renders = [], []
    for index in range(effort.rounds):
        film = native.core().render(ready, camera, *size, effort.native_samples, seed=7 + index)
        assert not film.dropped, film.dropped
        films.append(Estimate.of_film(film))
        seeds = range(index * effort.seeds, (index + 1) * effort.seeds)
        path = folder / "cycles.exr"
        renders += [render(scene, camera, size, effort.samples, seed, path) for seed in seeds]
        count = len(films)
        ours = Estimate(
            sum(item.mean for item in films) / count,
            sum(item.variance for item in films) / count**2,
        )
        cycles = Estimate.of_seeds(renders)
        verdict: Verdict = judge(ours, cycles, mask)
        if verdict.bias_noise.max() <= effort.noise:
            break
    return verdict, ours, cycles
