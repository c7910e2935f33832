# SPDX-License-Identifier: GPL-3.0-or-later
"""A fit by Mitsuba 3 as the 2022 thesis made them; runs in an environment of its own.

`python mitsuba_fit.py photo|fit REQUEST.json` leaves REQUEST's `photo` (.npy, (h, w, 3)), or its
`curve` (.json): CPU seconds since the first iteration began, loss and error of the values after
each. It ends at the `budget` of seconds, when the error has stayed below `level` for half as long
again as it took to get there, or when it is told to (SIGTERM), and leaves what it has.

The recipe: Adam with a constant learning rate of 0.03 for all unknowns, clamped after each step;
the dual-buffer loss mean((a - photo)(b - photo)) of two renders with seeds of their own, each of
`spp` samples; prb, or prbvolpath for a medium; a Principled BSDF, or rough dielectric around a
homogeneous medium of grey extinction. What is kinder to Mitsuba than the thesis' tool: roughness
is an unknown itself (not its square) and stays above the zone in which Mitsuba's Principled BSDF
has no derivative by it; paths end by Russian roulette instead of after 6 bounces.
"""

from __future__ import annotations

import json
import signal
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from mitsuba_side import film, mi, rgb  # noqa: E402,I001 - chooses LLVM before drjit looks for it
import drjit as dr  # noqa: E402
from synthetic import cases, stage  # noqa: E402

RATE = 0.03
#: sigma_t is so many times its unknown, as in the thesis: a step suits values of about 1.
DENSE = 10.0
#: Mitsuba's Principled BSDF renders all below 0.0316 alike.
LEAST_ROUGHNESS = 0.04
_PHOTO_SEED = 987654321
_PART = 64  # samples of a photo at a time
_STEADY = 5  # iterations after the first: what one costs without compilation


def write_ply(path, mesh, faces):
    """Some triangles of a mesh with its vertex normals."""
    vertices = np.hstack([mesh.positions, mesh.normals]).astype("<f4")
    rows = np.empty(len(faces), [("count", "u1"), ("corners", "<i4", 3)])
    rows["count"], rows["corners"] = 3, faces
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
    head += [f"property float {name}" for name in ("x", "y", "z", "nx", "ny", "nz")]
    head += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    path.write_bytes(("\n".join(head) + "\n").encode() + vertices.tobytes() + rows.tobytes())


def sensor_of(matrix, size):
    """Blender's cameras look along -z, Mitsuba's along z with x to the left."""
    return {
        "type": "perspective",
        "fov": float(np.degrees(2 * np.arctan(stage.SENSOR_MM[0] / 2 / stage.LENS_MM))),
        "fov_axis": "x",
        "to_world": mi.ScalarTransform4f(matrix @ np.diag([-1.0, 1.0, -1.0, 1.0])),
        "film": film(size),
        "sampler": {"type": "independent"},
    }


def lights_of(described):
    if described.sky is not None:
        # Its frame: y up, z to the middle of the picture, which is +x here.
        frame = [[0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]]
        sky = described.sky * np.asarray(described.world, np.float32)
        picture = mi.Bitmap(np.ascontiguousarray(sky))
        matrix = mi.ScalarTransform4f(np.array(frame, float))
        return {"sky": {"type": "envmap", "bitmap": picture, "to_world": matrix}}
    lamp = described.lamp
    half = lamp.side / 2
    place = mi.ScalarTransform4f(lamp.matrix @ np.diag([-half, half, -half, 1.0]))
    emitted = lamp.power / (np.pi * lamp.side**2)
    return {
        "world": {"type": "constant", "radiance": rgb(described.world)},
        "lamp": {
            "type": "rectangle",
            "to_world": place,
            "emitter": {"type": "area", "radiance": rgb([emitted] * 3)},
        },
    }


def body_of(medium):
    """The material with any values: `Unknowns` sets them."""
    if not medium:
        return {
            "bsdf": {
                "type": "principled",
                "base_color": rgb([0.5] * 3),
                "roughness": 0.5,
                "spec_trans": 0.5,
                "eta": 1.5,
            }
        }
    return {
        "bsdf": {
            "type": "roughdielectric",
            "distribution": "ggx",
            "alpha": 0.25,
            "int_ior": 1.5,
            "ext_ior": 1.0,
        },
        "interior": {
            "type": "homogeneous",
            "sigma_t": 0.5,
            "scale": DENSE,
            "albedo": rgb([0.5] * 3),
            "phase": {"type": "isotropic"},
        },
    }


def load(request, case):
    described = stage.make(case.mesh, case.lighting, 1)
    folder = Path(request["folder"])
    items = {"type": "scene", "sensor": sensor_of(described.cameras[0], request["size"])}
    items |= lights_of(described)
    path = folder / "body.ply"
    write_ply(path, described.body, described.body.triangles)
    items["body"] = {"type": "ply", "filename": str(path)} | body_of("albedo" in case.target)
    for slot, level in enumerate(stage.TILE_COLOURS):
        path = folder / f"tiles_{slot}.ply"
        write_ply(path, described.floor, described.floor.triangles[described.floor.slots == slot])
        tile = {"type": "diffuse", "reflectance": rgb([level] * 3)}
        items[f"tiles_{slot}"] = {"type": "ply", "filename": str(path), "bsdf": tile}
    return mi.load_dict(items)


class Unknowns:
    """Parameter names and values of the stage's body on Mitsuba's side."""

    #: name -> (key in the scene, to Mitsuba's number, its type); differentiable
    SURFACE = {
        "base_color": ("bsdf.base_color.value", lambda x: x, mi.Color3f),
        "roughness": ("bsdf.roughness.value", lambda x: x, mi.Float),
        "transmission": ("bsdf.spec_trans.value", lambda x: x, mi.Float),
        "ior": ("bsdf.eta", lambda x: x, mi.Float),
    }
    MEDIUM = {
        "albedo": ("interior_medium.albedo.value.value", lambda x: x, mi.Color3f),
        "extinction": ("interior_medium.sigma_t.value.value", lambda x: x, mi.Float),
        "roughness": ("bsdf.alpha.value", dr.square, mi.Float),
        "ior": ("bsdf.eta", lambda x: x, mi.Float),
    }

    def __init__(self, scene, medium, bounds):
        self.table = self.MEDIUM if medium else self.SURFACE
        self.parameters = mi.traverse(scene)
        self.bounds = {
            name: [limit / DENSE for limit in pair] if name == "extinction" else pair
            for name, pair in bounds.items()
        }
        low, high = self.bounds["roughness"]
        self.bounds["roughness"] = [max(low, LEAST_ROUGHNESS), high]

    def from_values(self, values):
        """name -> Mitsuba's type; an extinction is grey and in units of DENSE."""
        found = {}
        for name, (_, _, kind) in self.table.items():
            value = [float(x) for x in values[name]]
            found[name] = kind(value[0] / DENSE) if name == "extinction" else kind(*value)
        return found

    def to_values(self, variables):
        """name -> list of numbers, as in the case."""
        found = {}
        for name in self.table:
            value = np.ravel(np.array(variables[name], np.float64)).tolist()
            found[name] = [value[0] * DENSE] * 3 if name == "extinction" else value
        return found

    def put(self, variables):
        """Assigns anew: a derivative of what is changed in place is silently 0."""
        for name, (key, convert, _) in self.table.items():
            kind = type(self.parameters[f"body.{key}"])
            self.parameters[f"body.{key}"] = kind(convert(variables[name]))
        self.parameters.update()


def integrator_of(medium):
    return mi.load_dict(
        {"type": "prbvolpath" if medium else "prb", "max_depth": 256, "rr_depth": 5}
    )


def photo(request, case):
    """Renders in parts: one of a thousand samples would not fit into memory."""
    medium = "albedo" in case.target
    scene, integrator = load(request, case), integrator_of(medium)
    unknowns = Unknowns(scene, medium, request["bounds"])
    unknowns.put(unknowns.from_values(case.target))
    dr.set_thread_count(1)
    parts = [
        np.array(mi.render(scene, integrator=integrator, spp=_PART, seed=_PHOTO_SEED + i))
        for i in range(-(-request["photo_spp"] // _PART))
    ]
    path = Path(request["photo"])
    path.parent.mkdir(parents=True, exist_ok=True)
    np.save(path, np.mean(parts, axis=0, dtype=np.float64).astype(np.float32))


def fit(request, case):
    medium = "albedo" in case.target
    scene, integrator = load(request, case), integrator_of(medium)
    unknowns = Unknowns(scene, medium, request["bounds"])
    wanted = mi.TensorXf(np.load(request["photo"]))
    optimiser = mi.ad.Adam(lr=RATE)
    for name, value in unknowns.from_values(case.start).items():
        optimiser[name] = value
    dr.set_thread_count(1)
    seconds, errors, losses = [], [], []
    start_error = cases.mean_error(case, unknowns.to_values(optimiser))
    until, inside_since = request["budget"], None
    ended = []
    signal.signal(signal.SIGTERM, lambda *_: ended.append(True))
    begin = time.process_time()
    while not seconds or (seconds[-1] < until and not ended):
        unknowns.put(optimiser)
        seed = 2 * len(seconds) + 1_000_000 * case.seed
        a, b = (
            mi.render(scene, unknowns.parameters, integrator=integrator, spp=request["spp"], seed=s)
            for s in (seed, seed + 1)
        )
        loss = dr.mean((a - wanted) * (b - wanted), axis=None)
        dr.backward(loss)
        optimiser.step()
        for name in unknowns.table:
            optimiser[name] = dr.clip(optimiser[name], *unknowns.bounds[name])
        answer = unknowns.to_values(optimiser)
        seconds.append(time.process_time() - begin)
        if len(seconds) == 1:
            until += seconds[0]  # nearly all of it is compilation
        losses.append(float(loss.numpy().item()))
        errors.append(cases.mean_error(case, answer))
        if errors[-1] >= request["level"]:
            inside_since = None
        elif inside_since is None:
            inside_since = seconds[-1]
        elif seconds[-1] >= 1.5 * inside_since:
            break
    steady = np.diff(seconds)[:_STEADY]
    compiling = max(0.0, seconds[0] - float(np.median(steady))) if len(steady) else 0.0
    found = {"seconds": seconds, "errors": errors, "losses": losses, "compiling": compiling}
    found |= {"start_error": start_error, "answer": answer, "mitsuba": mi.__version__}
    Path(request["curve"]).write_text(json.dumps(found), encoding="utf-8")


def main():
    what, path = sys.argv[1:]
    request = json.loads(Path(path).read_text(encoding="utf-8"))
    {"photo": photo, "fit": fit}[what](request, cases.make(request["kind"], request["seed"]))


if __name__ == "__main__":
    main()
