# SPDX-License-Identifier: GPL-3.0-or-later
"""pytest inside bpy: the add-on on the path, a new empty scene for every test."""

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
for folder in (ROOT / "addon", ROOT / "blender_tests"):
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

import made_scenes  # noqa: E402


@pytest.fixture(scope="session", autouse=True)
def native():
    """Both native modules; every test needs at least their parameter table."""
    from selenite import native as modules

    reason = modules.why_unavailable()
    if reason:
        pytest.skip(f"the native modules are not built: {reason}")
    return modules


@pytest.fixture(scope="module", autouse=True)
def factory_settings():
    """Preferences and Blender's own add-ons as they come, once for all tests of a file: they take
    eight times as long as a file of factory settings."""
    bpy.ops.wm.read_factory_settings(use_empty=True)


@pytest.fixture(autouse=True)
def empty_scene(request, factory_settings):
    """A file of factory settings without any object, but for a test that only looks at what its
    module has rendered: hundreds of them would wait for a scene longer than for its picture."""
    if request.node.get_closest_marker("without_scene") is None:
        made_scenes.open_empty_file()


@pytest.fixture
def lit_ball(tmp_path):
    """A file with a coloured ball under a lamp, nothing in front of it; it renders 32 x 24."""
    made_scenes.studio(base_color=(0.2, 0.6, 0.4), roughness=0.5)
    made_scenes.light("Key Light", energy=200)
    return made_scenes.save(tmp_path / "scene.blend")


@pytest.fixture
def small_panoramas(monkeypatch):
    """A quarter of the columns and rows of a world that Cycles evaluates: for what has no details.
    Two million pixels take longer than all else of a test."""
    made_scenes.shrink_panoramas(monkeypatch, 4)


@pytest.fixture
def addon():
    """The add-on, registered for the length of a test."""
    import selenite

    selenite.register()
    yield selenite
    selenite.unregister()
