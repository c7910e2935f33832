# SPDX-License-Identifier: GPL-3.0-or-later
"""An iteration on a bitmap with Mitsuba 3, for who cannot import it: in an environment of its own.

`mitsuba_texture.py SCENE.json THREADS`, with a scene as `scenes.make_textured` describes it. Reads
requests from stdin, a line of JSON each, and answers with a line each:
  {"spp": N, "seed": N}  -> {"cpu": seconds of a picture with the derivative by every texel of its
                            mean squared difference from 0.3, "mean": [r, g, b]}
  {"spp": N, "seed": N, "out": FILE}
                         -> the same of its mean, each channel for itself, which goes into a .npy
"""

import json
import os
import sys
import time
from pathlib import Path

os.environ.setdefault("DRJIT_LIBLLVM_PATH", "/usr/lib/x86_64-linux-gnu/libLLVM.so.19.1")

import drjit as dr
import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_rgb")

from mitsuba_side import film, mesh, rgb  # noqa: E402 - these need the variant

TEXELS = "body.bsdf.reflectance.data"


def load(scene):
    transform = mi.ScalarTransform4f()
    camera, lamp = scene["camera"], scene["lamp"]
    # raw: the file holds linear numbers.
    image = mi.Bitmap(scene["image"]).convert(mi.Bitmap.PixelFormat.RGB)
    bitmap = {"type": "bitmap", "bitmap": image, "raw": True, "filter_type": "bilinear"}
    return mi.load_dict(
        {
            "type": "scene",
            "sensor": {
                "type": "perspective",
                "fov": camera["fov"],
                "fov_axis": "x",
                "to_world": transform.look_at(camera["origin"], camera["target"], [0, 0, 1]),
                "film": film(scene["size"]),
                "sampler": {"type": "independent"},
            },
            "body": mesh(scene["body"]["mesh"], {"type": "diffuse", "reflectance": bitmap}),
            "ground": mesh(
                scene["ground"]["mesh"],
                {"type": "diffuse", "reflectance": rgb(scene["ground"]["reflectance"])},
            ),
            "lamp": {
                "type": "disk",
                "to_world": transform.look_at(lamp["origin"], lamp["target"], [0, 1, 0])
                @ transform.scale([lamp["size"] / 2] * 3),
                "emitter": {"type": "area", "radiance": rgb([lamp["radiance"]] * 3)},
            },
        }
    )


def main():
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)
    scene = load(json.loads(Path(sys.argv[1]).read_text(encoding="utf-8")))
    # Reading and writing files with a single thread stops Mitsuba for ever.
    dr.set_thread_count(int(sys.argv[2]))
    integrator = mi.load_dict({"type": "prb", "max_depth": 64, "rr_depth": 5})
    params = mi.traverse(scene)
    for line in sys.stdin:
        request = json.loads(line)
        started = time.process_time()
        params[TEXELS] = type(params[TEXELS])(dr.detach(params[TEXELS]))
        dr.enable_grad(params[TEXELS])
        params.update()
        image = mi.render(
            scene, params, integrator=integrator, spp=request["spp"], seed=request["seed"]
        )
        out = request.get("out")
        dr.backward(
            3 * dr.mean(image, axis=None) if out else dr.mean(dr.square(image - 0.3), axis=None)
        )
        gradient = dr.grad(params[TEXELS])
        dr.eval(gradient)
        dr.sync_thread()
        cpu = time.process_time() - started
        if out:
            np.save(out, np.array(gradient))
        mean = np.array(image, np.float64).mean(axis=(0, 1))
        answers.write(json.dumps({"cpu": cpu, "mean": mean.tolist()}) + "\n")


if __name__ == "__main__":
    main()
