# SPDX-License-Identifier: GPL-3.0-or-later
"""result.json of a result folder: what is written into it, and what is read from it."""

from __future__ import annotations

import math
import platform
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .. import __version__, mean_free_path
from ..capture.prepared import UNALIGNED, Alignment, Capture, Gain
from ..fit import trust
from ..fit.capture_render import alignment_of
from ..fit.checkpoint import RESULT
from ..fit.diagnosis.gauge import Gauge, gauges
from ..fit.fields import FieldUnknown
from ..fit.job import fitted_values
from ..fit.model_error import EXPLAINED, ModelError
from ..fit.old_names import renamed
from ..fit.pattern import of_field
from ..fit.plan import FitPlan
from ..fit.unknowns import Unknown
from ..json_text import read_json
from ..parameters import Values, plain, split_name
from ..paths import file_stems
from ..problems import BadInput, Problem
from .finished_fit import FinishedFit, Intervals
from .hold_out import Comparison

if TYPE_CHECKING:
    from .._core import FoundStage

SCHEMA = 1
#: Of a file that cannot be read.
CURE = "give the folder of a fit that has ended"


@dataclass(frozen=True)
class ParameterRow:
    """initial, value: a number, or one for each channel. about: keys of some parameters alone, as
    the files of a grid."""

    initial: float | Sequence[float]
    value: float | Sequence[float]
    minimum: float
    maximum: float
    certainty: trust.Certainty
    unit: str
    about: Mapping[str, object] = field(default_factory=dict)

    def as_json(self) -> dict[str, object]:
        """Uncertainties are null where unknown."""
        return {
            "initial": self.initial,
            "value": self.value,
            "minimum": self.minimum,
            "maximum": self.maximum,
            **self.certainty.as_json(),
            "unit": self.unit,
            **self.about,
        }


@dataclass(frozen=True)
class PhotoRow:
    """gain_interval_90: None where the gain is given. shift: pixels of the file and degrees;
    shift_believed: None where it is given. residual_rms: None in a fit that has not ended;
    unexplained: None where noise may hide what is left."""

    gain: Gain
    gain_interval_90: Intervals | None = None
    shift: Alignment = UNALIGNED
    shift_believed: bool | None = None
    residual_rms: float | None = None
    unexplained: float | None = None
    mask_share: float = 1.0
    isolated_light: float = 0.0

    def as_json(self) -> dict[str, object]:
        """The same for each photo, so that a reader need not ask whether its gain or shift was
        free."""
        of_fit = {"residual_rms": self.residual_rms, "unexplained": self.unexplained}
        of_shift = {"shift_believed": self.shift_believed}
        return {
            "gain": self.gain,
            "gain_interval_90": self.gain_interval_90,
            "shift": self.shift,
            **(of_fit if self.residual_rms is not None else {}),
            **(of_shift if self.shift_believed is not None else {}),
            "mask_share": self.mask_share,
            "isolated_light": self.isolated_light,
        }


@dataclass(frozen=True)
class LossRow:
    """Of the start and of the result, by the same weights and random numbers; NaN where it was not
    validated."""

    start: float
    result: float
    standard_error: float
    start_kept: bool
    model_error: ModelError


@dataclass(frozen=True)
class StageRow:
    """A stage that has begun; the order is that of the file."""

    name: str
    parameters: Sequence[str]
    iterations: int
    spp: int
    height: int
    best_iteration: int
    stopped_because: str
    samples: int
    seconds: float
    cpu_seconds: float
    values: Mapping[str, Sequence[float]]

    @staticmethod
    def of(stage: FoundStage) -> StageRow:
        """As the fit has found it."""
        return StageRow(
            stage.name, stage.parameters, stage.iterations, stage.spp, stage.height,
            stage.best_iteration, stage.stopped_because, stage.samples, stage.seconds,
            stage.cpu_seconds, stage.values,
        )  # fmt: skip


@dataclass(frozen=True)
class ResultFile:
    """All of it; units are in the rows. stages: None without any."""

    versions: Mapping[str, str]
    seed: int
    parameters: Mapping[str, ParameterRow]
    misfit: trust.Misfit | None
    alternative_minima: Sequence[Mapping[str, Sequence[float]]]
    ambiguous: Sequence[str]
    gauge: Sequence[Gauge]
    loss: LossRow
    best_iteration: int
    iterations: int
    stopped_because: str
    samples: int
    seconds: float
    cpu_seconds: float
    dropped: int
    model: str
    pictures: Mapping[str, str]
    captures: Mapping[str, PhotoRow]
    hold_out: Comparison | None
    warnings: Sequence[str]
    stages: Sequence[StageRow] | None = None

    @staticmethod
    def of(plan: FitPlan, result: FinishedFit, host: str) -> ResultFile:
        """host: version of Blender."""
        fit, values = result.fit, fitted_values(plan, result.fit)
        rows = {}
        for item in plan.unknowns:
            value = values[item.owner, item.parameter.name]
            rows[item.name] = _parameter_row(item, value, plan, result)
        for one in plan.fields:
            rows[one.name] = _field_row(one, result)
        return ResultFile(
            versions={
                "selenite": __version__,
                "blender": host,
                "python": platform.python_version(),
                "numpy": np.__version__,
            },
            seed=plan.request.settings.seed,
            parameters=rows,
            misfit=trust.misfit(fit),
            alternative_minima=fit.report.alternative_minima,
            ambiguous=fit.report.ambiguous,
            gauge=gauges(fit),
            loss=LossRow(
                fit.start_validation,
                fit.best_validation,
                fit.best_validation_standard_error,
                fit.kept_start,
                ModelError(
                    fit.model_error.relative, fit.model_error.absolute, fit.model_error.shift
                ),
            ),
            best_iteration=fit.best_iteration,
            iterations=fit.iterations,
            stopped_because=fit.stopped_because,
            samples=fit.samples,
            seconds=fit.seconds,
            cpu_seconds=fit.cpu_seconds,
            dropped=fit.dropped,
            model=plan.model,
            pictures=file_stems(item.id for item in plan.captures),
            captures={item.id: photo_row(item, result) for item in plan.captures},
            hold_out=Comparison(result.hold_out) if result.hold_out else None,
            warnings=[*plan.warnings, *result.notes],
            stages=None if fit.stages is None else [StageRow.of(stage) for stage in fit.stages],
        )

    def as_json(self) -> dict[str, object]:
        """The content of the file, and of what `selenite fit --json` prints."""
        of_stages: dict[str, object] = {}
        if self.stages is not None:
            of_stages["stages"] = [asdict(stage) for stage in self.stages]
        return {
            "schema": SCHEMA,
            "versions": self.versions,
            "seed": self.seed,
            "parameters": {name: row.as_json() for name, row in self.parameters.items()},
            "misfit": self.misfit.as_json() if self.misfit else None,
            "alternative_minima": self.alternative_minima,
            "ambiguous": self.ambiguous,
            "gauge": [one.as_json() for one in self.gauge],
            "loss": asdict(self.loss),
            "best_iteration": self.best_iteration,
            "iterations": self.iterations,
            "stopped_because": self.stopped_because,
            "samples": self.samples,
            "seconds": self.seconds,
            "cpu_seconds": self.cpu_seconds,
            "dropped": self.dropped,
            "model": self.model,
            "pictures": self.pictures,
            "captures": {name: row.as_json() for name, row in self.captures.items()},
            "hold_out": self.hold_out.as_json() if self.hold_out else None,
            "warnings": self.warnings,
            **of_stages,
        }


def _parameter_row(
    unknown: Unknown, value: Values, plan: FitPlan, result: FinishedFit
) -> ParameterRow:
    about: dict[str, object] = {}
    if unknown.parameter.name == "extinction":
        start = mean_free_path.of(unknown.start, plan.millimetres)
        found = mean_free_path.of(value, plan.millimetres)
        about["mean_free_path"] = {"initial": start.value, **found.as_json()}
    return ParameterRow(
        plain(unknown.start),
        plain(value),
        unknown.minimum,
        unknown.maximum,
        trust.certainty(unknown, result.fit),
        unknown.parameter.unit,
        about,
    )


def _field_row(item: FieldUnknown, result: FinishedFit) -> ParameterRow:
    about = item.about(result.fields[item.name], result.coverage.get(item.name))
    if (agreement := result.halves.get(item.name)) is not None:
        about["halves"] = agreement.as_json()
    if (pattern := of_field(result.fit, item.name)) is not None:
        about["pattern"] = pattern.as_json()
    return ParameterRow(
        item.mean(item.values),
        result.mean(item),
        item.minimum,
        item.maximum,
        trust.Certainty(),
        item.UNIT,
        about,
    )


def photo_row(capture: Capture, result: FinishedFit) -> PhotoRow:
    """What the fit has found of a photo, and how much of it counts."""
    row = PhotoRow(capture.gain, mask_share=capture.mask_share, isolated_light=capture.isolated)
    found = result.fit.captures.get(capture.id)
    if found is None:
        return row
    row = replace(row, residual_rms=found.residual_rms, unexplained=found.unexplained or None)
    if found.gain is not None:
        row = replace(row, gain=found.gain, gain_interval_90=result.gain_interval(capture.id))
    if found.shift is None:
        return row
    height, width = capture.reference.shape[:2]
    across, down, roll = alignment_of(capture, result.fit)
    columns, rows = capture.photo_size
    shift = (across * columns / width, down * rows / height, math.degrees(roll))
    return replace(row, shift=shift, shift_believed=capture.id not in result.doubtful_shifts)


@dataclass(frozen=True)
class StoredParameter:
    """Tuples have an entry for each channel. initial: () where a file does not say it. interval_90:
    None where there is none. files: of a grid or an image, without a folder."""

    value: Values
    initial: Values = ()
    interval_90: tuple[tuple[float, float] | None, ...] = ()
    determined: bool | None = None
    files: tuple[str, ...] = ()


@dataclass(frozen=True)
class StoredPhoto:
    """None: the file says nothing of it. shift: pixels of the photo, and degrees."""

    gain: Gain | None = None
    shift: Alignment | None = None


@dataclass(frozen=True)
class StoredResult:
    """What other commands take from a result.json, of this version or an earlier one."""

    parameters: Mapping[str, StoredParameter] = field(default_factory=dict)
    captures: Mapping[str, StoredPhoto] = field(default_factory=dict)
    model_error: ModelError = EXPLAINED

    def as_found(self, capture: Capture) -> Capture:
        """The capture with its gain and alignment."""
        found = self.captures.get(capture.id, StoredPhoto())
        gain = capture.gain if found.gain is None else found.gain
        if found.shift is None:
            return replace(capture, gain=gain)
        (height, width), (columns, rows) = capture.reference.shape[:2], capture.photo_size
        across, down, roll = found.shift
        alignment = (across * width / columns, down * height / rows, math.radians(roll))
        return replace(capture, gain=gain, alignment=alignment)


def stored_result(folder: Path) -> StoredResult:
    """Of a result folder. Raises BadInput."""
    try:
        return _read(folder / RESULT)
    except ValueError as error:
        raise BadInput(Problem(f"File '{folder / RESULT}'", str(error), CURE)) from error


def _read(path: Path) -> StoredResult:
    """Raises ValueError."""
    content = read_json(path)
    if not isinstance(content, dict):
        raise ValueError("it holds no object")
    content = renamed(content)
    if not isinstance(content.get("parameters"), dict):
        raise ValueError("it has no 'parameters'")
    parameters = {}
    for name, row in _rows(content, "parameters"):
        split_name(name)
        parameters[name] = _parameter(name, row)
    captures = {name: _photo(name, row) for name, row in _rows(content, "captures")}
    return StoredResult(parameters, captures, _model_error(content))


def _rows(content: Mapping[str, object], key: str) -> list[tuple[str, Mapping[str, object]]]:
    """Of a key that may be missing."""
    found = content.get(key)
    if found is None:
        return []
    if not isinstance(found, dict) or not all(isinstance(row, dict) for row in found.values()):
        raise ValueError(f"'{key}' is {found!r}, not an object of objects")
    return list(found.items())


def _numbers(value: object) -> list[float] | None:
    """One or several; None where it is something else."""
    items: list[object] = value if isinstance(value, list) else [value]
    found = [float(x) for x in items if isinstance(x, (int, float)) and not isinstance(x, bool)]
    return found if len(found) == len(items) and found and np.isfinite(found).all() else None


def _parameter(name: str, row: Mapping[str, object]) -> StoredParameter:
    value, initial, between = row.get("value"), row.get("initial"), row.get("interval_90")
    numbers, determined = _numbers(value), row.get("determined")
    if numbers is None:
        raise ValueError(f"the value of '{name}' is {value!r}")
    ends: list[object] = (
        between if isinstance(value, list) and isinstance(between, list) else [between]
    )
    pairs = [_numbers(pair) if pair is not None else [] for pair in ends]
    if any(pair is None or len(pair) not in (0, 2) for pair in pairs):
        raise ValueError(f"the interval of '{name}' is {between!r}")
    return StoredParameter(
        tuple(numbers),
        tuple(_numbers(initial) or ()),
        tuple((pair[0], pair[1]) if pair else None for pair in pairs),
        determined if isinstance(determined, bool) else None,
        _files(name, row),
    )


def _files(name: str, row: Mapping[str, object]) -> tuple[str, ...]:
    """The folder's own files."""
    files = row.get("files", [])
    if not isinstance(files, list) or not all(
        isinstance(file, str) and file and Path(file).name == file for file in files
    ):
        raise ValueError(f"the files of '{name}' are {files!r}")
    return tuple(files)


def _photo(name: str, row: Mapping[str, object]) -> StoredPhoto:
    gain, shift = row.get("gain"), row.get("shift")
    of_gain, of_shift = _numbers(gain), _numbers(shift)
    if gain is not None and (of_gain is None or len(of_gain) not in (1, 3) or min(of_gain) <= 0):
        raise ValueError(f"the gain of photo '{name}' is {gain!r}, not one or three above 0")
    if shift is not None and (of_shift is None or len(of_shift) != 3):
        raise ValueError(f"the shift of photo '{name}' is {shift!r}, not two pixels and an angle")
    return StoredPhoto(
        _three(of_gain * 3) if of_gain else None, _three(of_shift) if of_shift else None
    )


def _three(numbers: Sequence[float]) -> tuple[float, float, float]:
    first, second, third = numbers[:3]
    return first, second, third


def _model_error(content: Mapping[str, object]) -> ModelError:
    """0 where a file has none, or has null."""
    loss = content.get("loss")
    found = loss.get("model_error") if isinstance(loss, dict) else None
    if not isinstance(found, dict):
        return EXPLAINED
    names = ("relative", "absolute", "shift")
    numbers = [_numbers(found.get(name, 0.0)) for name in names]
    if any(one is None or len(one) != 1 for one in numbers):
        raise ValueError(f"the model error is {found!r}")
    return ModelError(*(one[0] for one in numbers if one))
