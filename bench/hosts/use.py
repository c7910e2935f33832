# SPDX-License-Identifier: GPL-3.0-or-later
"""In one Blender: installs the shipped zip, uses it as a person would, removes it. Writes JSON.

PYTHON bench/hosts/use.py ZIP FOLDER, or blender -b --factory-startup --python ... -- ZIP FOLDER.
Nothing of the checkout's add-on is on the path. The process ends as Blender ends it: its status is
the driver's to judge.
"""

import importlib
import json
import sys
import time
import traceback
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "blender_tests"))

import bpy  # noqa: E402
import undo_steps  # noqa: E402
from pressed_buttons import TIMER, Pressed  # noqa: E402

ZIP, FOLDER = Path(sys.argv[-2]).resolve(), Path(sys.argv[-1]).resolve()
EXTENSIONS = bpy.app.version >= (4, 2)
MODULE = "bl_ext.user_default.selenite" if EXTENSIONS else "selenite"
MATERIAL = "Jade"
LONGEST = 300  # seconds of a fit


def part(name):
    """A module of the installed add-on."""
    return importlib.import_module(f"{MODULE}.{name}")


def colour():
    """Of the material as it stands in the scene."""
    nodes = bpy.data.materials[MATERIAL].node_tree.nodes
    node = next(item for item in nodes if item.bl_idname == "ShaderNodeBsdfPrincipled")
    return tuple(node.inputs["Base Color"].default_value)[:3]


def fitted():
    """Of the result that the panel keeps."""
    rows = bpy.context.scene.selenite.results
    return next(tuple(row.value)[:3] for row in rows if row.parameter == "base_color")


def install():
    if EXTENSIONS:
        done = bpy.ops.extensions.package_install_files(
            filepath=str(ZIP), repo="user_default", enable_on_install=False
        )
    else:
        done = bpy.ops.preferences.addon_install(filepath=str(ZIP))
    assert done == {"FINISHED"}, done


def enable():
    bpy.ops.preferences.addon_enable(module=MODULE)
    native = part("native")
    assert not native.why_unavailable(), native.why_unavailable()
    assert ROOT not in Path(native.core().__file__).resolve().parents
    assert hasattr(bpy.types, "SELENITE_PT_fit")


def open_demo():
    """The demo scene of the package, small, its photos as captures, one parameter ticked."""
    demo = part("demo")
    example, _ = demo._scene()
    FOLDER.mkdir(parents=True, exist_ok=True)
    example.EXAMPLE.save_start(FOLDER / "start.blend")
    scene = bpy.context.scene
    scene.render.resolution_percentage = 25
    scene.cycles.samples = 8
    settings = scene.selenite
    bpy.ops.selenite.refresh_rows()
    photos = [{"name": f"{camera}.png"} for camera in ("Front", "Side")]
    bpy.ops.selenite.load_photos(directory=str(demo.scenes() / demo.NAME), files=photos)
    assert all(capture.camera for capture in settings.captures)
    for row in settings.rows:
        row.enabled = row.parameter == "base_color" and MATERIAL in row.owner
    assert [row.parameter for row in settings.rows if row.enabled] == ["base_color"]
    settings.height, settings.spp, settings.iterations = 48, 4, 6
    settings.search, settings.picture_spp = "off", 4
    settings.output = str(FOLDER / "fits")


def fit():
    open_demo()
    before = colour()
    assert bpy.ops.selenite.start() == {"FINISHED"}
    assert colour() == before, "a fit changes nothing before Apply"
    true = (0.33, 0.72, 0.47)
    error = max(abs(a - b) for a, b in zip(fitted(), true, strict=True))
    start = max(abs(a - b) for a, b in zip(before, true, strict=True))
    assert error < start / 2, f"off by {error:.3f} after the fit, by {start:.3f} before"
    return f"off by {error:.3f}, {start:.2f} before"


def begun():
    """The Start button, pressed: a fit that would go on for long."""
    bpy.context.scene.selenite.iterations = 2000
    bpy.context.scene.selenite.tolerance = 0
    button = Pressed(part("interface.operators.fit").SELENITE_OT_start)
    assert button._start(bpy.context)
    assert button.modal(bpy.context, TIMER) == {"PASS_THROUGH"}
    return button


def ended(button):
    """What the operator answers when the fit is over."""
    until = time.monotonic() + LONGEST
    while time.monotonic() < until:
        answer = button.modal(bpy.context, TIMER)
        if answer != {"PASS_THROUGH"}:
            return answer
        time.sleep(0.1)
    raise AssertionError(f"the fit has not ended within {LONGEST} s")


def stop():
    button = begun()
    assert bpy.ops.selenite.stop() == {"FINISHED"}
    assert ended(button) == {"FINISHED"}
    assert len(bpy.context.scene.selenite.results) == 1


def cancel():
    before = colour(), fitted()
    button = begun()
    assert bpy.ops.selenite.cancel() == {"FINISHED"}
    assert ended(button) == {"CANCELLED"}
    assert (colour(), fitted()) == before


def apply():
    undo_steps.prepare()
    assert bpy.ops.selenite.apply("EXEC_DEFAULT", True) == {"FINISHED"}
    assert max(abs(a - b) for a, b in zip(colour(), fitted(), strict=True)) < 1e-6


def undo():
    applied = colour()
    assert bpy.ops.ed.undo.poll(), "Blender has no step to undo"
    undo_steps.undo()
    assert colour() != applied, f"the colour is still {applied}"
    assert not bpy.context.scene.selenite.applied


def check_in_cycles():
    assert bpy.ops.selenite.check_in_cycles() == {"FINISHED"}
    sheet = Path(part("interface.state").CHECK.sheet)
    assert sheet.stat().st_size > 1000, sheet


def disable():
    bpy.ops.preferences.addon_disable(module=MODULE)
    assert not hasattr(bpy.types.Scene, "selenite")
    assert not hasattr(bpy.types, "SELENITE_PT_fit")


def remove():
    place = Path(sys.modules[MODULE].__file__).parent
    if EXTENSIONS:
        repositories = bpy.context.preferences.extensions.repos
        index = next(i for i, item in enumerate(repositories) if item.module == "user_default")
        bpy.ops.extensions.package_uninstall(repo_index=index, pkg_id="selenite")
    else:
        try:
            bpy.ops.preferences.addon_remove(module=MODULE)
        except RuntimeError as error:  # when all is removed it redraws a window, which is not there
            if "tag_redraw" not in str(error):
                raise
    assert not place.exists(), place


STEPS = (install, enable, fit, apply, undo, stop, cancel, check_in_cycles, disable, remove)


def main():
    report = {"version": bpy.app.version_string, "steps": {}}
    for step in STEPS:
        begin = time.monotonic()
        try:
            said = step() or "yes"
        except Exception as error:  # noqa: BLE001 - told, and the driver fails
            line = traceback.extract_tb(error.__traceback__)[-1]
            said = f"NO: {type(error).__name__}: {error} ({Path(line.filename).name}:{line.lineno})"
        seconds = round(time.monotonic() - begin, 1)
        report["steps"][step.__name__] = {"said": said, "seconds": seconds}
        FOLDER.mkdir(parents=True, exist_ok=True)
        (FOLDER / "report.json").write_text(json.dumps(report, indent=1))
        print(f"{step.__name__}: {said} ({seconds} s)", flush=True)
        if said.startswith("NO") and step in (install, enable):
            break


main()
