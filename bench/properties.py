# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench properties`: a render by Cycles with each property at another value.

A scene with every kind of datablock is rendered with each settable property of the class "no effect
on radiance" at another value, and compared bit by bit with the render before. Rows that change the
noise only are compared by their means. With `--class`, the same for another class: what changes
nothing there may be classed too severely. Status 1 if a property without effect changes a picture.
"""

import argparse
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "blender_tests")]

import bpy  # noqa: E402
import numpy as np  # noqa: E402
import property_scenes as made  # noqa: E402

from selenite import native  # noqa: E402
from selenite.cycles_check.render import without_words  # noqa: E402
from selenite.scene_read.properties.judge import places  # noqa: E402
from selenite.scene_read.properties.rows import Effect  # noqa: E402
from selenite.scene_read.properties.tables import TABLES, chain_of  # noqa: E402

# They would change the file under us, or how long a render takes, not the picture.
LEFT_ALONE = {
    "RenderSettings.threads", "RenderSettings.threads_mode", "RenderSettings.use_overwrite",
    "RenderSettings.use_file_extension", "CyclesRenderSettings.device", "ID.tag",
    "CyclesRenderSettings.time_limit", "CyclesRenderSettings.preview_pause",
}  # fmt: skip


def rendered(samples, seed):
    """The picture, linear."""
    scene = bpy.context.scene
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "picture.exr"
        scene.render.filepath = str(path)
        scene.render.use_file_extension = False
        image = scene.render.image_settings
        image.file_format, image.color_mode, image.color_depth = "OPEN_EXR", "RGB", "32"
        scene.cycles.samples, scene.cycles.seed = samples, seed
        with without_words():
            bpy.ops.render.render(write_still=True)
        return native.image().read(str(path))[0]


def another(block, item):
    """A value of a property that differs from what it has, or None."""
    old = getattr(block, item.identifier)
    if item.type == "BOOLEAN":
        return [not value for value in old] if getattr(item, "array_length", 0) else not old
    if item.type == "ENUM" and not item.is_enum_flag:
        return next((e.identifier for e in item.enum_items if e.identifier != old), None)
    if item.type == "INT":
        if getattr(item, "array_length", 0):
            return [value + 1 for value in old]
        return old + 3 if old + 3 <= item.hard_max else old - 3
    if item.type == "FLOAT":
        if getattr(item, "array_length", 0):
            return None if item.array_length > 4 else [value + 0.3 for value in old]
        return old + 0.3 if old + 0.3 <= item.hard_max else old - 0.3
    return None


def candidates(effect):
    """(identifier, row, finder of the block, property), each once."""
    seen = set()
    for index, place in enumerate(places(made.scope())):
        for struct in chain_of(place.block.bl_rna):
            table = TABLES.get(struct.identifier)
            for name, row in table.by_name.items() if table else ():
                key = f"{struct.identifier}.{name}"
                item = place.block.bl_rna.properties.get(name)
                if row.effect is not effect or item is None or item.is_readonly:
                    continue
                if key in seen or key in LEFT_ALONE:
                    continue
                seen.add(key)
                yield key, row, index, item


def differences(effect, options):
    """(identifier, noise, relative change of the mean, share of the pixels that changed)."""
    made.scene_in_view()
    render = bpy.context.scene.render
    render.resolution_x = render.resolution_y = options.size
    todo = list(candidates(effect))
    base = rendered(options.samples, 1)
    assert np.array_equal(base, rendered(options.samples, 1)), "Cycles does not repeat itself"
    means = [rendered(options.many, seed).mean() for seed in (3, 4, 5, 6)]
    spread = float(np.std(means, ddof=1))
    for key, row, index, item in todo:
        if options.only and not any(word in key for word in options.only):
            continue
        block = list(places(made.scope()))[index].block
        value, old = another(block, item), getattr(block, item.identifier)
        if value is None:
            continue
        old = old if isinstance(old, (bool, int, float, str)) else list(old)
        try:
            setattr(block, item.identifier, value)
        except (TypeError, AttributeError, ValueError):
            continue
        picture = rendered(options.samples, 1)
        changed = float((picture != base).any(axis=2).mean())
        shift = picture.mean() / base.mean() - 1
        if row.noise and changed:
            mean = np.mean([rendered(options.many, seed).mean() for seed in (7, 8)])
            shift = mean / np.mean(means) - 1
            changed *= abs(shift) * np.mean(means) > 4 * spread
        block = list(places(made.scope()))[index].block
        setattr(block, item.identifier, old)
        yield key, row.noise, shift, changed


def main():
    parser = argparse.ArgumentParser(prog="./dev bench properties", description=__doc__)
    names = {effect.value.split()[0]: effect for effect in Effect}
    parser.add_argument("--class", dest="effect", choices=names, default="no")
    parser.add_argument("--only", nargs="*", default=[], help="parts of TYPE.PROPERTY")
    parser.add_argument("--size", type=int, default=16, help="pixels of a side")
    parser.add_argument("--samples", type=int, default=2)
    parser.add_argument("--many", type=int, default=64, help="samples, where noise changes")
    options = parser.parse_args()
    wrong = tried = 0
    for key, noise, shift, changed in differences(names[options.effect], options):
        tried += 1
        if bool(changed) == (options.effect == "no"):
            wrong += 1
            what = "noise" if noise else "picture"
            print(f"{key}: {what}: mean {100 * shift:+.2f} %, {100 * changed:.0f} % of the pixels")
            sys.stdout.flush()
    end = "change the picture" if options.effect == "no" else "do not change it"
    print(f"bpy {bpy.app.version_string}: {tried} properties tried, {wrong} {end}")
    return int(options.effect == "no" and wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
