# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of a reconstruction that are dropped on a 3D View, from Blender 4.1 on."""

from pathlib import Path
from types import SimpleNamespace

import bpy
import pytest
import reconstructed

pytestmark = [pytest.mark.blender, pytest.mark.blender34]
with_handlers = pytest.mark.skipif(
    not hasattr(bpy.types, "FileHandler"), reason="Blender 3.4 has no file handlers"
)

HANDLER = "SELENITE_FH_reconstruction"


def handler():
    """What Blender has under that name, None without any."""
    return bpy.types.FileHandler.bl_rna_get_subclass_py(HANDLER)


@with_handlers
def test_a_handler_is_there_as_long_as_the_addon(addon):
    found = handler()
    assert found.bl_import_operator == "selenite.import_reconstruction"
    addon.unregister()
    assert handler() is None
    addon.register()
    assert handler() is not None


@with_handlers
def test_the_endings_are_those_of_the_files_that_are_read(addon, tmp_path):
    reconstructed.written(tmp_path)
    endings = handler().bl_file_extensions.split(";")
    files = [tmp_path / "pebble.x3d", tmp_path / "cameras.xml", tmp_path / "transforms.json"]
    files += [*(tmp_path / "text").iterdir(), *(tmp_path / "binary").iterdir()]
    assert len(files) > 8 and {file.suffix for file in files} <= set(endings)
    for others in (".exr", ".png", ".obj", ".ply", ".glb", ".blend"):
        assert others not in endings


@with_handlers
def test_only_a_3d_view_takes_them(addon):
    for kind, takes in (("VIEW_3D", True), ("IMAGE_EDITOR", False)):
        context = SimpleNamespace(area=SimpleNamespace(type=kind))
        assert handler().poll_drop(context) is takes
    assert handler().poll_drop(SimpleNamespace(area=None)) is False


def test_a_file_is_imported_as_soon_as_it_is_dropped(addon, tmp_path):
    """Blender invokes the operator with the path of the file, and no dialogue opens."""
    reconstructed.written(tmp_path)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    dropped = tmp_path / "binary" / "images.bin"
    found = bpy.ops.selenite.import_reconstruction("INVOKE_DEFAULT", filepath=str(dropped))
    assert found == {"FINISHED"}
    assert [item.name for item in bpy.data.cameras] == [f"IMG_000{n}" for n in (1, 2, 3, 4)]
    assert [item.name for item in bpy.context.scene.collection.children] == ["binary"]
    assert Path(bpy.data.collections["binary"]["selenite_source"]) == dropped
