# SPDX-License-Identifier: GPL-3.0-or-later
"""The two native modules, imported when first used and therefore after bpy.

A loaded shared object cannot be replaced in a running Blender, so a version that differs from the
add-on's is refused with the request to restart.
"""

from __future__ import annotations

import importlib
from functools import cache
from types import ModuleType

from . import __version__


class NativeUnavailable(RuntimeError):
    """The native module is missing, does not load, or belongs to another version."""


def core() -> ModuleType:
    """Scene, renderer and fit (`_core`). Raises NativeUnavailable."""
    return _load("_core")


def image() -> ModuleType:
    """Reading and writing of pictures (`_image`). Raises NativeUnavailable."""
    return _load("_image")


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
