# SPDX-License-Identifier: GPL-3.0-or-later
"""The two native modules, imported when first used and therefore after bpy.

A loaded shared object cannot be replaced in a running Blender, so a version that differs from the
add-on's is refused with the request to restart.
"""

from __future__ import annotations

import importlib
from functools import cache
from types import ModuleType
from typing import TYPE_CHECKING, cast

from . import __version__

if TYPE_CHECKING:
    from . import _core, _image

    class Core:
        """The module `_core` as a type: Python has none for a single module."""

        __version__: str
        few_unknowns: int
        Problem = _core.Problem
        Cancelled = _core.Cancelled
        ProgressToken = _core.ProgressToken
        Film = _core.Film
        Scene = _core.Scene
        SceneBuilder = _core.SceneBuilder
        Photo = _core.Photo
        Unknown = _core.Unknown
        PhotoJacobian = _core.PhotoJacobian
        FisherInformation = _core.FisherInformation
        Evaluator = _core.Evaluator
        StopReason = _core.StopReason
        Progress = _core.Progress
        ParameterConfidence = _core.ParameterConfidence
        Misfit = _core.Misfit
        WeakDirection = _core.WeakDirection
        WrittenState = _core.WrittenState
        TrustReport = _core.TrustReport
        FoundPhoto = _core.FoundPhoto
        History = _core.History
        FoundStage = _core.FoundStage
        Search = _core.Search
        ModelError = _core.ModelError
        ShapeSteps = _core.ShapeSteps
        FieldPattern = _core.FieldPattern
        FitResult = _core.FitResult
        Stage = _core.Stage
        Fit = _core.Fit
        StageWorker = _core.StageWorker
        parameters = staticmethod(_core.parameters)
        closures = staticmethod(_core.closures)
        losses = staticmethod(_core.losses)
        optimisers = staticmethod(_core.optimisers)
        setting_ranges = staticmethod(_core.setting_ranges)
        refinement_spp = staticmethod(_core.refinement_spp)
        schedule = staticmethod(_core.schedule)
        render = staticmethod(_core.render)
        decide_aims = staticmethod(_core.decide_aims)
        has_lanes = staticmethod(_core.has_lanes)
        aimed_lamps = staticmethod(_core.aimed_lamps)
        with_aimed_lamps = staticmethod(_core.with_aimed_lamps)
        lanes_obstacle = staticmethod(_core.lanes_obstacle)
        first_hits = staticmethod(_core.first_hits)
        reparametrization = staticmethod(_core.reparametrization)
        fisher_information = staticmethod(_core.fisher_information)
        weakest_direction = staticmethod(_core.weakest_direction)
        expected_errors = staticmethod(_core.expected_errors)
        determined = staticmethod(_core.determined)
        information_gain = staticmethod(_core.information_gain)
        probe_columns = staticmethod(_core.probe_columns)
        probe = staticmethod(_core.probe)
        probe_slopes = staticmethod(_core.probe_slopes)

    class Image:
        """The module `_image` as a type."""

        __version__: str
        largest_picture: int
        Problem = _image.Problem
        probe = staticmethod(_image.probe)
        read = staticmethod(_image.read)
        read_at_size = staticmethod(_image.read_at_size)
        resize = staticmethod(_image.resize)
        write_exr = staticmethod(_image.write_exr)
        write_png = staticmethod(_image.write_png)
        srgb_encode = staticmethod(_image.srgb_encode)
        srgb_decode = staticmethod(_image.srgb_decode)


class NativeUnavailable(RuntimeError):
    """The native module is missing, does not load, or belongs to another version."""


def core() -> Core:
    """Scene, renderer and fit (`_core`). Raises NativeUnavailable."""
    return cast("Core", _load("_core"))


def image() -> Image:
    """Reading and writing of pictures (`_image`). Raises NativeUnavailable."""
    return cast("Image", _load("_image"))


def why_unavailable() -> str:
    """Empty if both modules load, else one sentence for the panel."""
    try:
        core()
        image()
    except NativeUnavailable as error:
        return str(error)
    return ""


@cache
def _load(name: str) -> ModuleType:
    try:
        module = importlib.import_module(f".{name}", __package__)
    except ImportError as error:
        raise NativeUnavailable(
            f"The native module '{name}' does not load ({error}); "
            "install the build of Selenite that is made for this Blender"
        ) from error
    found = getattr(module, "__version__", __version__)
    if found != __version__:
        raise NativeUnavailable(
            f"The native module '{name}' is version {found}, the add-on is {__version__}; "
            "restart Blender"
        )
    return module
