# SPDX-License-Identifier: GPL-3.0-or-later
"""File > Import > Reconstruction, the same button of the panel, and files dropped on a 3D View."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, StringProperty

from ...importers import to_blender, undistorted
from ...importers.plan import ImportRequest, make_plan
from ...importers.sources import read_any
from ...messages import joined, message, thing
from ...native import NativeUnavailable
from ...paths import MISSING, absolute, is_there
from ...problems import BadInput, Problem
from ..problem_reports import report_problems
from ..texts import announce, translated

#: Of files that can be dropped: all but those of meshes, which Blender's own importers take.
_ENDINGS = ".xml;.x3d;.x3dz;.json;.out;.xmp;.csv;.bin;.txt"
UP_ITEMS = (
    ("Z", "Z", "Metashape, RealityCapture, NeRF", 0),
    ("Y", "Y", "As the standard of X3D says", 1),
)


class SELENITE_OT_import_reconstruction(bpy.types.Operator):
    """Make cameras, captures and textured meshes of a reconstruction: Metashape, X3D, COLMAP,
    transforms.json, RealityCapture, Bundler, OBJ, PLY, glTF"""

    bl_idname = "selenite.import_reconstruction"
    bl_label = "Import Reconstruction"
    bl_options = {"REGISTER", "UNDO", "PRESET"}

    filepath: StringProperty(subtype="FILE_PATH", options={"SKIP_SAVE"})
    cameras: StringProperty(
        name="Cameras", description="File of the cameras, where the mesh has a file of its own"
    )
    photos: StringProperty(
        name="Photos",
        description="Folder of the photos, found by the label of their camera. Without it: where "
        "the file says",
    )
    masks: StringProperty(name="Masks", description="Folder of masks, whose black does not count")
    silhouette: BoolProperty(
        name="Silhouette", description="Only what the camera sees of the fitted objects counts"
    )
    use_scale: BoolProperty(
        name="Own Scale", description="Otherwise as the file says, or 1 m in a unit"
    )
    meters: FloatProperty(
        name="Metres in a Unit",
        description="Length of a unit of the file",
        default=1.0,
        min=1e-9,
        soft_max=1000.0,
        precision=5,
    )
    up: EnumProperty(name="Up", items=UP_ITEMS, description="The file's upward axis")
    undistort: BoolProperty(
        name="Undistort Photos",
        description="Write photos without the lens's distortion beside the file, so that they "
        "match Blender's cameras. A fit does not need this: it undoes distortion itself",
    )

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Opens the file browser; a file that was dropped is imported at once."""
        if self.filepath:
            return self.execute(context)
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Nothing is created if anything is wrong."""
        scene = context.scene
        try:
            request = self._request(scene)
            folder = request.file.parent / f"{request.file.stem}_photos"
            with _progress(context) as note, undistorted.taken_back(folder):
                plan = make_plan(request, read_any, note)
                if self.undistort:
                    plan = undistorted.write_photos(plan, folder, note)
                made = to_blender.create(plan, scene, note)
        except BadInput as error:
            report_problems(self, error)
            return {"CANCELLED"}
        except NativeUnavailable as error:
            announce(self, {"ERROR"}, str(error))
            return {"CANCELLED"}
        for text in plan.warnings:
            announce(self, {"WARNING"}, text)
        counts = message(
            "operators.cameras-photo",
            "{count} cameras, {captures} with a photo",
            count=len(made.cameras),
            captures=made.captures,
        )
        meshes = ", ".join(f"'{item.name}'" for item in made.meshes) or translated("no mesh")
        title = f"'{made.collection.name}'"
        announce(self, {"INFO"}, joined(": ", (title, joined("; ", (counts, meshes)))))
        return {"FINISHED"}

    def _request(self, scene: bpy.types.Scene) -> ImportRequest:
        file = _path(self.filepath)
        if not self.filepath or not is_there(file):
            cure = "choose a file of a reconstruction"
            raise BadInput(
                Problem(
                    thing("File", self.filepath),
                    MISSING,
                    cure,
                )
            )
        return ImportRequest(
            file=file,
            cameras=_path(self.cameras) if self.cameras else None,
            photos=_path(self.photos) if self.photos else None,
            masks=_path(self.masks) if self.masks else None,
            meters=self.meters if self.use_scale else None,
            up=self.up,
            unit_length=meters_in_unit(scene),
            silhouette=1 if self.silhouette else None,
        )


def meters_in_unit(scene: bpy.types.Scene) -> float:
    """Metres in one Blender unit."""
    units = scene.unit_settings
    return float(units.scale_length) if units.system != "NONE" else 1.0


def _path(text: str) -> Path:
    return absolute(bpy.path.abspath(text))


@contextmanager
def _progress(context: bpy.types.Context) -> Iterator[Callable[[str, float], None]]:
    """Blender's own progress, beside the pointer."""
    manager = context.window_manager
    manager.progress_begin(0, 100)
    try:
        yield lambda _text, fraction: manager.progress_update(round(100 * fraction))
    finally:
        manager.progress_end()


def _draw_menu(self: bpy.types.Menu, _context: bpy.types.Context) -> None:
    self.layout.operator(
        SELENITE_OT_import_reconstruction.bl_idname, text="Reconstruction (Metashape, COLMAP, X3D)"
    )


def add_to_menu() -> None:
    """To File > Import."""
    bpy.types.TOPBAR_MT_file_import.append(_draw_menu)


def remove_from_menu() -> None:
    """The inverse."""
    bpy.types.TOPBAR_MT_file_import.remove(_draw_menu)


CLASSES: tuple[type, ...] = (SELENITE_OT_import_reconstruction,)

if hasattr(bpy.types, "FileHandler"):  # 4.1 on

    class SELENITE_FH_reconstruction(bpy.types.FileHandler):
        """A file of a reconstruction, dropped on a 3D View"""

        bl_idname = "SELENITE_FH_reconstruction"
        bl_label = "Reconstruction"
        bl_import_operator = SELENITE_OT_import_reconstruction.bl_idname
        bl_file_extensions = _ENDINGS

        @classmethod
        def poll_drop(cls, context: bpy.types.Context) -> bool:
            """Over a 3D View."""
            return context.area is not None and context.area.type == "VIEW_3D"

    CLASSES = (*CLASSES, SELENITE_FH_reconstruction)
