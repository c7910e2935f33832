# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user sees: properties, operators, panels; and `blender --command selenite`."""

from __future__ import annotations

import atexit

import bpy

from . import environment_panel, panels, problem_reports, properties, stages, state
from .captures import examining
from .captures import lights as capture_lights
from .captures import operators as capture_operators
from .captures import photo as capture_photo
from .furniture import first_use, icon, languages, links, preferences, sample
from .importing import operators as import_operators
from .importing import tools as import_tools
from .operators import apply as apply_operators
from .operators import batch as batch_operators
from .operators import check as check_operators
from .operators import fit as fit_operators
from .operators import models as model_operators
from .operators import next_camera as camera_operators
from .operators import presets
from .operators import rows as row_operators
from .operators import stop as stop_operators
from .operators import time as time_operators
from .pictures import mask, view_through
from .pictures import operators as picture_operators
from .pictures import panel as picture_panel
from .pictures import properties as picture_properties
from .progress import background
from .result import panel as result_panel

_MODULES = (
    preferences,
    links,
    sample,
    presets,
    capture_lights,
    capture_photo,
    properties,
    problem_reports,
    background,
    row_operators,
    examining,
    capture_operators,
    mask,
    fit_operators,
    stop_operators,
    apply_operators,
    check_operators,
    time_operators,
    model_operators,
    batch_operators,
    camera_operators,
    result_panel,
    picture_properties,
    picture_operators,
    view_through,
    panels,
    environment_panel,
    picture_panel,
    import_operators,
    import_tools,
    stages,
)
_command: object | None = None


def register() -> None:
    """Registers every class, the scene's settings and the command line."""
    global _command
    for module in _MODULES:
        for item in module.CLASSES:
            _describe(item)
            bpy.utils.register_class(item)
    languages.register()
    icon.register()
    first_use.register()
    bpy.types.Scene.selenite = bpy.props.PointerProperty(type=properties.SeleniteSettings)
    picture_operators.register()
    import_operators.add_to_menu()
    atexit.register(state.end)  # where nobody switches the add-on off before
    if hasattr(bpy.utils, "register_cli_command"):  # 4.2 on
        _command = bpy.utils.register_cli_command("selenite", _run_command)


def unregister() -> None:
    """The inverse of `register`; whatever runs is stopped first."""
    global _command
    environment_panel.end()
    state.end()
    atexit.unregister(state.end)
    if _command is not None:
        bpy.utils.unregister_cli_command(_command)
        _command = None
    picture_operators.unregister()
    import_operators.remove_from_menu()
    del bpy.types.Scene.selenite
    first_use.unregister()
    icon.unregister()
    languages.unregister()
    for module in reversed(_MODULES):
        for item in reversed(module.CLASSES):
            bpy.utils.unregister_class(item)


def _describe(item: type) -> None:
    """Its docstring as a tooltip of one paragraph, which is also what languages translate."""
    if issubclass(item, (bpy.types.Operator, bpy.types.Panel)) and item.__doc__:
        item.bl_description = " ".join(item.__doc__.split())  # type: ignore[union-attr]


def _run_command(arguments: list[str]) -> int:
    from .. import cli

    return cli.run_as_process(arguments)
