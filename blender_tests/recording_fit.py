# SPDX-License-Identifier: GPL-3.0-or-later
"""In place of the native fit: notes what it is asked for, and answers with values of its own.

What it answers is chosen so that a mix-up shows: the best values are neither the start nor the
last ones, the best iteration is not the last, and no two channels are alike.
"""

import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from selenite import native

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "python"))

from made_results import made_fit, made_history, made_progress  # noqa: E402

ITERATIONS, BEST_ITERATION = 5, 3
MEAN_BIAS = (0.125, -0.25, 0.5)
#: Where the values lie between their bounds, in the first component; each next one is a bit higher.
BEST, LAST, STEP = 0.3, 0.75, 0.04


def _name(unknown):
    return f"{unknown.owner}:{unknown.parameter}"


class RecordingFit:
    """The interface of the native Fit. It "runs" for `polls` looks at its state, or until it is
    cancelled where that is None. `captures`: what every result says of photos."""

    captures = {}

    def __init__(self, scene, photos, unknowns, settings, polls, shapes, stages=()):
        self.scene, self.photos, self.settings, self.stages = scene, photos, settings, stages
        self.unknowns = [item for item in unknowns if item.start]
        names = [_name(item) for item in unknowns if not item.start]
        self._shapes = {name: shapes[name] for name in names}
        self.calls = []
        self._left = polls
        self._cancelled = False

    def between(self, share):
        """Name -> a value for each component, that share of the way between the bounds."""
        found = {}
        for item in self.unknowns:
            low, high = item.minimum, item.maximum
            shares = [share + STEP * k for k in range(len(item.start))]
            found[_name(item)] = [low + part * (high - low) for part in shares]
        return found

    @property
    def best(self):
        """What every result has to show."""
        return self.between(BEST)

    @property
    def last(self):
        """What no result may show."""
        return self.between(LAST)

    def fields(self, share):
        """Name -> values of a field: no two voxels alike, around `share`."""
        return {
            name: (share + 0.1 * np.sin(np.arange(np.prod(shape), dtype=np.float32))).reshape(shape)
            for name, shape in self._shapes.items()
        }

    @property
    def start_values(self):
        return {_name(item): item.start for item in self.unknowns}

    def start(self):
        self.calls.append("start")

    def cancel(self):
        self.calls.append("cancel")
        self._cancelled = True

    def join(self):
        self.calls.append("join")
        assert self._left is not None or self._cancelled, "it would wait for ever"
        self._left = 0

    def request_state(self, _file):
        self.calls.append("request_state")

    def take_state(self):
        return None

    def restore(self, file, seconds):
        self.calls.append(("restore", file, seconds))

    def preview(self, _index):
        return None

    def progress(self):
        running = "start" in self.calls and not self._cancelled and self._left != 0
        if running and self._left is not None:
            self._left -= 1
        over = "start" in self.calls and not running
        return made_progress(
            running=running,
            done=over,
            stopped=self._stopped() if over else native.core().StopReason.NONE,
            stopped_because=self._reason() if over else "",
            phase_fraction=0.5,
            stage=len(self.stages) - 1 if over and self.stages else 0,
            iteration=ITERATIONS if over else 1,
            own_iteration=ITERATIONS if over else 1,
            iterations=self.settings["iterations"],
            loss=0.25,
            validation=0.125,
            validation_standard_error=0.0625,
            seconds=1.5,
            seconds_left=0.0,
            values=self.last,
        )

    def _stopped(self):
        reasons = native.core().StopReason
        return reasons.CANCELLED if self._cancelled else reasons.CONVERGED

    def _reason(self):
        return "cancelled" if self._cancelled else "converged"

    def result(self, *, fields=True):
        report = {
            name: {
                "standard_error": [0.01 * (k + 1) for k in range(len(value))],
                "interval_90": [(x - 0.02 * (k + 1), x + 0.03) for k, x in enumerate(value)],
                "determined": [True] * len(value),
                "at_bound": [None] * len(value),
                "correlated_with": [None] * len(value),
            }
            for name, value in self.best.items()
        }
        misfit = {"value": 0.0025, "standard_error": 0.0001, "explained": False}
        return made_fit({
            "values_last": self.last,
            "values_best": self.best,
            "fields_last": self.fields(LAST) if fields else {},
            "fields_best": self.fields(BEST) if fields else {},
            "best_iteration": BEST_ITERATION,
            "best_validation": 0.125,
            "best_validation_standard_error": 0.0625,
            "iterations": ITERATIONS,
            "stopped": self._stopped(),
            "stopped_because": self._reason(),
            "optimiser": self.settings["optimiser"],
            "samples": 1234,
            "seconds": 1.5,
            "cpu_seconds": 2.5,
            "dropped": 6,
            "captures": self.captures,
            "report": {"parameters": report, "passes": 3, "misfit": misfit},
            "history": vars(self.history()),
            **({"stages": [self._about(stage) for stage in self.stages]} if self.stages else {}),
        })  # fmt: skip

    def _about(self, stage):
        values = {name: self.best[name] for name in stage.parameters}
        return {
            "name": stage.name, "parameters": stage.parameters, "iterations": ITERATIONS,
            "spp": stage.settings["spp"], "height": stage.photos[0].size[1],
            "best_iteration": BEST_ITERATION, "stopped_because": self._reason(), "samples": 617,
            "seconds": 0.75, "cpu_seconds": 1.25, "values": values,
        }  # fmt: skip

    def history(self, of_stage=False):
        """From the start to the last values, the best ones in their iteration."""
        rows = ITERATIONS + 1
        place = np.linspace(0.0, 1.0, rows)[:, None]
        values = {}
        for name, first in self.start_values.items():
            values[name] = (1 - place) * np.array(first) + place * np.array(self.last[name])
            values[name][BEST_ITERATION] = self.best[name]
        bias = np.array(MEAN_BIAS) * (1 - 0.1 * np.arange(rows))[:, None]
        return made_history({
            "iteration": np.arange(rows),
            "loss": np.linspace(1.0, 0.25, rows),
            "validation": np.linspace(0.9, 0.125, rows),
            "validation_standard_error": np.full(rows, 0.0625),
            "mean_bias": bias,
            "values": values,
            "field_means": {
                name: np.tile(value.mean(axis=tuple(range(value.ndim - 1))), (rows, 1))
                for name, value in self.fields(BEST).items()
            },
        })  # fmt: skip


class Recorded:
    """What reached the native side: every fit, every picture, and the options of materials."""

    def __init__(self):
        self.fits = []
        self.pictures = []
        self.materials = []

    @property
    def fit(self):
        """The only one."""
        (found,) = self.fits
        return found


def install(monkeypatch, polls=2, shapes=None):
    """Puts the recording fit, and notes of pictures and materials, into the native module for the
    length of a test. `polls`: see RecordingFit. `shapes`: of the fields that may be fitted.
    """
    core, recorded = native.core(), Recorded()
    evaluator, builder = core.Evaluator, core.SceneBuilder

    def fit(*given, stages=(), workers=None):
        if stages:  # what is asked of it besides is that of the last
            (unknowns,), last = given, stages[-1]
            given = (last.scene, last.photos, unknowns, last.settings)
        made = RecordingFit(*given, polls, shapes or {}, stages)
        recorded.fits.append(made)
        return made

    def stage(name, parameters, fields, scene, photos, settings):
        return SimpleNamespace(name=name, parameters=parameters, fields=fields, scene=scene,
                               photos=photos, settings=settings)  # fmt: skip

    class NotedEvaluator:
        def __init__(self, scene, **options):
            self._of, self._scene, self._options = evaluator(scene, **options), scene, options

        def picture(self, photo, spp, **options):
            noted = {"depth": 0, "threads": 0} | self._options | options
            recorded.pictures.append(SimpleNamespace(
                scene=self._scene, camera=photo.camera, size=tuple(photo.size), spp=spp,
                frame=photo.frame, alignment=tuple(photo.alignment), **noted,
            ))  # fmt: skip
            return self._of.picture(photo, spp, **options)

        def __getattr__(self, name):
            return getattr(self._of, name)

    class NotedBuilder:
        def __init__(self):
            self._builder = builder()

        def add_material(self, name, values, **options):
            recorded.materials.append({"name": name, **options})
            return self._builder.add_material(name, values, **options)

        def __getattr__(self, name):
            return getattr(self._builder, name)

    monkeypatch.setattr(core, "Fit", fit)
    monkeypatch.setattr(core, "Stage", stage)
    monkeypatch.setattr(core, "Evaluator", NotedEvaluator)
    monkeypatch.setattr(core, "SceneBuilder", NotedBuilder)
    return recorded


def values_of(scene, names):
    """Name -> value in a native scene."""
    return {name: scene.get(*name.rsplit(":", 1)).tolist() for name in names}
