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
import sys
import time
from pathlib import Path

import drjit as dr
import numpy as np
from mitsuba_side import load, mesh, mi, serve

TEXELS = "body.bsdf.reflectance.data"


def body_of(scene):
    # raw: the file holds linear numbers.
    image = mi.Bitmap(scene["image"]).convert(mi.Bitmap.PixelFormat.RGB)
    bitmap = {"type": "bitmap", "bitmap": image, "raw": True, "filter_type": "bilinear"}
    return mesh(scene["body"]["mesh"], {"type": "diffuse", "reflectance": bitmap})


def main():
    description = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    scene = load(description, body_of(description))
    # Reading and writing files with a single thread stops Mitsuba for ever.
    dr.set_thread_count(int(sys.argv[2]))
    integrator = mi.load_dict({"type": "prb", "max_depth": 64, "rr_depth": 5})
    params = mi.traverse(scene)

    def answer(request):
        started = time.process_time()
        params[TEXELS] = type(params[TEXELS])(dr.detach(params[TEXELS]))
        dr.enable_grad(params[TEXELS])
        params.update()
        image = mi.render(
            scene, params, integrator=integrator, spp=request["spp"], seed=request["seed"]
        )
        out = request.get("out")
        loss = 3 * image if out else dr.square(image - 0.3)
        dr.backward(dr.mean(loss, axis=None))
        gradient = dr.grad(params[TEXELS])
        dr.eval(gradient)
        dr.sync_thread()
        cpu = time.process_time() - started
        if out:
            np.save(out, np.array(gradient))
        return {"cpu": cpu, "mean": np.array(image, np.float64).mean(axis=(0, 1)).tolist()}

    serve(answer)


if __name__ == "__main__":
    main()
