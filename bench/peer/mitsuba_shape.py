# SPDX-License-Identifier: GPL-3.0-or-later
"""An iteration on vertices with Mitsuba 3, for who cannot import it: in an environment of its own.

`mitsuba_shape.py SCENE.json THREADS GUIDING`, with a scene as `scenes.make` describes it. Reads
requests from stdin, a line of JSON each, and answers with a line each:
  {"spp": N, "seed": N}  -> {"cpu": seconds of a picture with the derivative of its mean squared
                            difference from 0.3 by every vertex}
  {"spp": N, "seed": N, "judge": true}
                         -> {"growth": the derivative of the picture's mean as the body grows,
                             "difference": the same by pictures of a body 1 % larger and smaller}
"""

import json
import sys
import time
from pathlib import Path

import drjit as dr
import numpy as np
from mitsuba_side import load, mesh, mi, rgb, serve

VERTICES = "body.vertex_positions"
_DIRECT = 2  # of Mitsuba's depths: what a lamp lights, seen at once
_STEP = 0.01


def main():
    description = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    body = mesh(
        description["body"]["mesh"],
        {"type": "diffuse", "reflectance": rgb(description["body"]["reflectance"])},
    )
    scene = load(description, body)
    # Reading and writing files with a single thread stops Mitsuba for ever.
    dr.set_thread_count(int(sys.argv[2]))
    integrator = mi.load_dict(
        {"type": "prb_projective", "max_depth": _DIRECT, "guiding": sys.argv[3]}
    )
    plain = mi.load_dict({"type": "path", "max_depth": _DIRECT})
    params = mi.traverse(scene)
    places = np.array(params[VERTICES])

    def mean_of(scale, request):
        params[VERTICES] = type(params[VERTICES])((places * scale).astype(np.float32))
        params.update()
        seen = mi.render(scene, integrator=plain, spp=request["spp"], seed=request["seed"])
        return float(np.array(seen, np.float64).mean())

    def answer(request):
        started = time.process_time()
        params[VERTICES] = type(params[VERTICES])(dr.detach(params[VERTICES]))
        dr.enable_grad(params[VERTICES])
        params.update()
        image = mi.render(
            scene, params, integrator=integrator, spp=request["spp"], seed=request["seed"]
        )
        judge = request.get("judge")
        dr.backward(dr.mean(image if judge else dr.square(image - 0.3), axis=None))
        gradient = dr.grad(params[VERTICES])
        dr.eval(gradient)
        dr.sync_thread()
        if not judge:
            return {"cpu": time.process_time() - started}
        growth = float(np.array(gradient, np.float64) @ places)
        ends = [mean_of(1 + side * _STEP, request) for side in (-1, 1)]
        mean_of(1, request)  # as it was
        return {"growth": growth, "difference": (ends[1] - ends[0]) / (2 * _STEP)}

    serve(answer)


if __name__ == "__main__":
    main()
