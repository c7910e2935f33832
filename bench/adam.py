# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench adam`: fits of glass by Adam with and without pairs of pictures, at equal CPU time.

What `./dev bench estimators` measures as noise, as error of an answer: everything but the IOR and
the colour starts at its true value. Prints the error of the last values and their root mean square.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "bench")]

import numpy as np  # noqa: E402
from synthetic import fits, scenes, stage  # noqa: E402

from selenite import native, parameters  # noqa: E402

TRUE = {"base_color": [0.7, 0.5, 0.35], "transmission": 0.9, "ior": 1.5}
START = {"base_color": [0.6, 0.6, 0.6], "ior": 1.3}
_PHOTO_SEED = 987654321
#: CPU time of an iteration with pairs over one without: `./dev bench estimators`.
_COST = 2.13


def unknowns(values, rate):
    table = parameters.table()
    bounds = {name: table["material", name] for name in values}
    return [
        native.core().Unknown(
            scenes.OWNER, name, bounds[name].fit_lower, bounds[name].fit_upper,
            np.ravel(value).tolist(), rate,
        )
        for name, value in values.items()
    ]  # fmt: skip


def fit(roughness, finite_differences, seed, options):
    """Error of the last values by parameter, and CPU seconds."""
    true = TRUE | {"roughness": roughness}
    shown = scenes.make(options.mesh, "lamp", true, 1)
    camera = shown.cameras[0]
    size = (options.size, options.size)
    photo = native.core().render(shown, camera, *size, options.photo_spp, seed=_PHOTO_SEED).image
    values = true | START
    iterations = options.iterations if finite_differences else round(options.iterations * _COST)
    settings = {
        "optimiser": "adam", "iterations": iterations, "spp": options.spp, "seed": seed,
        "tolerance": 0.0, "threads": 1, "finite_differences": finite_differences, "search": "off",
        "refinement": "off", "validation_interval": 20,
    }  # fmt: skip
    job = native.core().Fit(
        scenes.make(options.mesh, "lamp", values, 1),
        [native.core().Photo(camera, photo)],
        unknowns(values, options.learning_rate),
        settings,
    )
    result, cpu = fits.ended(job, options.mesh)
    found = {key.partition(":")[2]: value for key, value in result.values_last.items()}
    return {n: float(np.abs(np.ravel(found[n]) - np.ravel(true[n])).mean()) for n in true}, cpu


def main():
    parser = argparse.ArgumentParser(prog="./dev bench adam", description=__doc__)
    add = parser.add_argument
    add("--roughness", type=float, nargs="*", default=(0.05, 0.1), help="(%(default)s)")
    add("--seeds", type=int, default=4, help="(%(default)s)")
    add("--iterations", type=int, default=60, help="with pairs (%(default)s)")
    add("--learning-rate", type=float, default=0.01, help="(%(default)s)")
    add("--size", type=int, default=64, help="pixels, square (%(default)s)")
    add("--spp", type=int, default=4, help="of an iteration (%(default)s)")
    add("--photo-spp", type=int, default=512, help="(%(default)s)")
    add("--mesh", choices=stage.MESHES, default="bunny_6598", help="(%(default)s)")
    options = parser.parse_args()
    for roughness in options.roughness:
        for finite_differences in (True, False):
            label = f"roughness {roughness:g}, {'pairs' if finite_differences else 'detached'}"
            runs = [
                fit(roughness, finite_differences, seed, options) for seed in range(options.seeds)
            ]
            root = {n: np.sqrt(np.mean([e[n] ** 2 for e, _ in runs])) for n in runs[0][0]}
            errors = ", ".join(f"{name} {error:.3f}" for name, error in root.items())
            each = " ".join(f"{error['ior']:.3f}" for error, _ in runs)
            cpu = np.mean([seconds for _, seconds in runs])
            print(f"{label}: {errors}; IOR of each {each}; {cpu:.1f} CPU s", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
