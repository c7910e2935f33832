# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders with Mitsuba 3, for who cannot import it: runs in an environment of its own.

Reads requests from stdin, a line of JSON each, and answers with a line each:
  {"load": {...}}           a scene as `scenes.py` describes it; its parameters replace all before
  {"spp": N, "seed": N}     -> {"mean": [r, g, b]} over the mask of the scene
"""

import json
import os
import sys

import numpy as np

# Mitsuba itself finds LLVM 15 first, which cannot compile for AVX-512.
os.environ.setdefault("DRJIT_LIBLLVM_PATH", "/usr/lib/x86_64-linux-gnu/libLLVM.so.19.1")

import mitsuba as mi

mi.set_variant("llvm_ad_rgb")
mi.set_log_level(mi.LogLevel.Error)


def rgb(value):
    return {"type": "rgb", "value": [float(x) for x in value]}


def mesh(path, bsdf):
    """Flat triangles: no interpolated normals, which every renderer treats in its own way."""
    return {"type": "ply", "filename": path, "face_normals": True, "bsdf": bsdf}


def body_of(values):
    """Rough glass and what is in it. Cycles' width is the square of the roughness."""
    glass = {
        "type": "roughdielectric",
        "distribution": "ggx",
        "alpha": values["roughness"] ** 2,
        "int_ior": values["ior"],
        "ext_ior": 1.0,
    }
    body = mesh(values["mesh"], glass)
    if values["sigma_t"] > 0:
        body["interior"] = {
            "type": "homogeneous",
            "sigma_t": values["sigma_t"],
            "albedo": rgb(values["albedo"]),
            "phase": {"type": "hg", "g": values["g"]},
        }
    return body


def film(size):
    """Square, a box filter: a sample stays in its pixel."""
    return {
        "type": "hdrfilm",
        "width": size,
        "height": size,
        "rfilter": {"type": "box"},
        "pixel_format": "rgb",
        "component_format": "float32",
    }


def load(scene, body):
    """A description's scene, and in it a body."""
    transform = mi.ScalarTransform4f()
    size, camera, lamp = scene["size"], scene["camera"], scene["lamp"]
    items = {
        "type": "scene",
        "sensor": {
            "type": "perspective",
            "fov": camera["fov"],
            "fov_axis": "x",
            "to_world": transform.look_at(camera["origin"], camera["target"], [0, 0, 1]),
            "film": film(size),
            "sampler": {"type": "independent"},
        },
        "body": body,
        "ground": mesh(
            scene["ground"]["mesh"],
            {"type": "diffuse", "reflectance": rgb(scene["ground"]["reflectance"])},
        ),
    }
    if any(scene["world"]):
        items["world"] = {"type": "constant", "radiance": rgb(scene["world"])}
    if lamp:
        place = transform.look_at(lamp["origin"], lamp["target"], [0, 1, 0])
        items["lamp"] = {
            "type": "disk",
            "to_world": place @ transform.scale([lamp["size"] / 2] * 3),
            "emitter": {"type": "area", "radiance": rgb([lamp["radiance"]] * 3)},
        }
    return mi.load_dict(items)


def serve(answer):
    """Answers requests until there are no more."""
    # Nothing that a library prints may come between the answers.
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)
    for line in sys.stdin:
        answers.write(json.dumps(answer(json.loads(line))) + "\n")


def main():
    integrator = mi.load_dict({"type": "volpath", "max_depth": -1, "rr_depth": 8})
    scene = mask = None

    def answer(request):
        nonlocal scene, mask
        if "load" in request:
            wanted = request["load"]
            scene, mask = load(wanted, body_of(wanted["body"])), np.load(wanted["mask"])
            return {}
        picture = mi.render(scene, integrator=integrator, spp=request["spp"], seed=request["seed"])
        return {"mean": np.array(picture, np.float64)[mask].mean(axis=0).tolist()}

    serve(answer)


if __name__ == "__main__":
    main()
