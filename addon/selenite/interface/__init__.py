# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user sees: properties, operators, panels; and `blender --command selenite`."""

from __future__ import annotations

import bpy

from . import (
    apply_operators,
    camera_operators,
    capture_lights,
    capture_photo,
    check_operators,
    fit_operators,
    import_operators,
    import_tools,
    panels,
    preview_operators,
    properties,
    row_operators,
    stages,
    state,
    time_operators,
)

_MODULES = (
    capture_lights,
    capture_photo,
    properties,
    row_operators,
    preview_operators,
    fit_operators,
    apply_operators,
    check_operators,
    time_operators,
    camera_operators,
    import_operators,
    panels,
    import_tools,
    stages,
)
_command: object | None = None


def register() -> None:
    """Registers every class, the scene's settings and the command line."""
    global _command
    for module in _MODULES:
        for item in module.CLASSES:
            bpy.utils.register_class(item)
    bpy.types.Scene.selenite = bpy.props.PointerProperty(type=properties.SeleniteSettings)
    import_operators.add_to_menu()
    if hasattr(bpy.utils, "register_cli_command"):  # 4.2 on
        _command = bpy.utils.register_cli_command("selenite", _run_command)


def unregister() -> None:
    """The inverse of `register`; whatever runs is stopped first."""
    global _command
    state.CHECK.stop()
    state.TRADE.stop()
    state.NEXT.stop()
    state.ESTIMATE.stop()
    state.STAGES.stop()
    state.RUN.stop(keep=False)
    if _command is not None:
        bpy.utils.unregister_cli_command(_command)
        _command = None
    import_operators.remove_from_menu()
    del bpy.types.Scene.selenite
    for module in reversed(_MODULES):
        for item in reversed(module.CLASSES):
            bpy.utils.unregister_class(item)


def _run_command(arguments: list[str]) -> int:
    from .. import cli

    return cli.run_as_process(arguments)
