# SPDX-License-Identifier: GPL-3.0-or-later
"""Examples that the help of each command ends with."""

from __future__ import annotations

import argparse

#: Command ("": of the program itself) -> (what it does, the line).
EXAMPLES: dict[str, tuple[tuple[str, str], ...]] = {
    "": (
        ("a fit from start to result, on a scene of its own", "demo"),
        ("whether a scene can be fitted", "check scene.blend"),
        ("a fit to its photos, with the values in a copy", "fit scene.blend --save fitted.blend"),
        ("the options of a command, with more examples", "fit --help"),
    ),
    "check": (
        ("what is understood of a scene, and every problem", "check scene.blend"),
        ("the photos of a fit, before it", "check scene.blend --photo Front=front.exr"),
        ("the same as data for a script", "check scene.blend --json"),
    ),
    "render": (
        ("a quarter of a Full HD picture", "render scene.blend --height 540 --out front.exr"),
        ("with another value", "render scene.blend --set Jade:roughness=0.2 --out sharp.png"),
    ),
    "gradient": (
        ("by two parameters", "gradient scene.blend --parameter Jade:ior Jade:roughness"),
        ("as pictures", "gradient scene.blend --parameter Jade:ior --out-dir derivatives"),
    ),
    "probe": (
        ("the BSDF for each row of a table", "probe rows.csv --out values.csv --derivatives"),
    ),
    "fit": (
        ("the usual parameters to the photos of the scene", "fit scene.blend --save fitted.blend"),
        (
            "one material to two photos",
            "fit scene.blend --fit Jade:base_color,roughness --photo Front=front.png "
            "--photo Side=side.png",
        ),
        ("a quick answer first", "fit scene.blend --preset draft"),
        ("again, from its record", "fit selenite-fits/2026-01-31_12-00-00/run.json"),
        ("on with a run that was interrupted", "fit --resume selenite-fits/DATE_TIME.unfinished"),
    ),
    "batch": (
        ("the fits of a file, or those that are left of it", "batch objects.toml"),
    ),
    "compare": (
        ("by photos that no fit has seen", "compare selenite-fits/DATE_TIME --captures more.json"),
    ),
    "next-camera": (
        ("after a fit", "next-camera selenite-fits/2026-01-31_12-00-00"),
        ("with the camera in a copy", "next-camera scene.blend --save with_camera.blend"),
    ),
    "trade": (
        ("expected seconds and errors, without fits", "trade scene.blend --expected"),
        ("measured within ten minutes", "trade scene.blend --budget 600 --out trade"),
    ),
    "lamps": (
        ("which suns the world's image holds", "lamps scene.blend"),
        ("in a copy, with the rest of the image", "lamps scene.blend --save with_suns.blend"),
    ),
    "import": (
        (
            "cameras and mesh of Metashape, with photos",
            "import head.x3d --cameras cameras.xml --photos photos --silhouette 1 "
            "--save head.blend",
        ),
        (
            "cameras of COLMAP and a mesh from it",
            "import mesh.ply --cameras sparse/0 --photos images --save scene.blend",
        ),
    ),
    "demo": (("everything into a folder", "demo --out my-demo"),),
}  # fmt: skip


def with_examples(parser: argparse.ArgumentParser, name: str) -> None:
    """Puts the examples of a command below its options, line by line."""
    lines = ["examples:"]
    for text, words in EXAMPLES[name]:
        lines += [f"  {text}:", f"    selenite {words}"]
    section = f", section {name}" if name else ""
    lines += ["", f"manual: docs/guide/command_line.md{section}"]
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.epilog = "\n".join(lines)
