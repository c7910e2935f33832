# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench properties`: a render by Cycles with each property at another value.

A scene with every kind of datablock is rendered with each settable property of the class "no effect
on radiance" at another value, and compared bit by bit with the render before. Rows that change the
noise only are compared by their means. With `--class`, the same for another class: what changes
nothing there may be classed too severely. Status 1 if a property without effect changes a picture.
In Debian's Blender: blender -b --factory-startup --python bench/properties.py -- [OPTIONS].
"""

import argparse
import sys
import tempfile
from dataclasses import dataclass
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
            inherited = struct.base.properties.keys() if struct.base else ()
            for name, row in table.by_name.items() if table else ():
                key = f"{struct.identifier}.{name}"
                item = place.block.bl_rna.properties.get(name)
                if row.effect is not effect or item is None or item.is_readonly:
                    continue
                if effect is not Effect.NO_EFFECT and name not in row.names:
                    continue  # it acts only together with another one
                if name in inherited:  # a version has moved it to the base type
                    continue
                if key in seen or key in LEFT_ALONE:
                    continue
                seen.add(key)
                yield key, row, index, item


@dataclass
class Trial:
    """A property at another value: whether that changes only noise, and what came of it."""

    key: str
    noise: bool
    index: int
    name: str
    shift: float = 0.0  # of the mean, relative
    share: float = 0.0  # of the pixels that changed


class Comparison:
    """Renders with properties at other values, against renders of the scene as it is."""

    def __init__(self, options):
        made.scene_in_view()
        render = bpy.context.scene.render
        render.resolution_x = render.resolution_y = options.size
        self.options = options
        self.base = rendered(options.samples, 1)
        assert np.array_equal(self.base, rendered(options.samples, 1)), "Cycles does not repeat"
        means = [rendered(options.many, seed).mean() for seed in (3, 4, 5, 6)]
        self.mean, self.spread = np.mean(means), np.std(means, ddof=1)

    def changes(self, trials):
        """Whether the picture is another one with all of these at once; notes by how much."""
        before = [self._set(trial) for trial in trials]
        noise = trials[0].noise
        if noise:
            shift = rendered(self.options.many, 7).mean() / self.mean - 1
            share = float(abs(shift) * self.mean > 4 * self.spread)
        else:
            picture = rendered(self.options.samples, 1)
            share = float((picture != self.base).any(axis=2).mean())
            shift = picture.mean() / self.base.mean() - 1
        for trial, old in reversed(list(zip(trials, before, strict=True))):
            if old is not None:
                setattr(self._block(trial), trial.name, old)
        for trial in trials:
            trial.shift, trial.share = shift, share
        said = f"{trials[0].key} ({len(trials)}): {'another' if share else 'the same'} picture"
        print(said, file=sys.stderr, flush=True)
        return share > 0

    def _block(self, trial):
        return list(places(made.scope()))[trial.index].block

    def _set(self, trial):
        """Returns what stood there, None if nothing was changed."""
        block = self._block(trial)
        value, old = another(block, block.bl_rna.properties[trial.name]), getattr(block, trial.name)
        if value is None:
            return None
        old = old if isinstance(old, (bool, int, float, str)) else list(old)
        try:
            setattr(block, trial.name, value)
        except (TypeError, AttributeError, ValueError):
            return None
        return old

    def culprits(self, trials):
        """Those of several that change the picture, by halves."""
        if not trials or not self.changes(trials):
            return
        if len(trials) == 1:
            yield trials[0]
            return
        half = len(trials) // 2
        yield from self.culprits(trials[:half])
        yield from self.culprits(trials[half:])


def tried(effect, options):
    """All trials of a class, and those that change the picture."""
    comparison = Comparison(options)
    trials = [
        Trial(key, row.noise, index, item.identifier)
        for key, row, index, item in candidates(effect)
        if not options.only or any(word in key for word in options.only)
    ]
    if effect is not Effect.NO_EFFECT:  # most of them do, one by one
        return trials, [trial for trial in trials if comparison.changes([trial])]
    found = []
    for place in dict.fromkeys((trial.key.partition(".")[0], trial.noise) for trial in trials):
        group = [t for t in trials if (t.key.partition(".")[0], t.noise) == place]
        found += comparison.culprits(group)
    return trials, found


def main():
    parser = argparse.ArgumentParser(prog="./dev bench properties", description=__doc__)
    names = {effect.value.split()[0]: effect for effect in Effect}
    parser.add_argument("--class", dest="effect", choices=names, default="no")
    parser.add_argument("--only", nargs="*", default=[], help="parts of TYPE.PROPERTY")
    parser.add_argument("--size", type=int, default=16, help="pixels of a side")
    parser.add_argument("--samples", type=int, default=2)
    parser.add_argument("--many", type=int, default=64, help="samples, where noise changes")
    arguments = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
    options = parser.parse_args(arguments)
    trials, found = tried(names[options.effect], options)
    harmless = options.effect == "no"
    for trial in found if harmless else [trial for trial in trials if trial not in found]:
        what = "noise" if trial.noise else "picture"
        numbers = f"mean {100 * trial.shift:+.2f} %, {100 * trial.share:.0f} % of the pixels"
        print(f"{trial.key}: {what}: {numbers}", flush=True)
    print(
        f"bpy {bpy.app.version_string}: {len(trials)} properties, {len(found)} change the picture"
    )
    return int(harmless and bool(found))


if __name__ == "__main__":
    sys.exit(main())
