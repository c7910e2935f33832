# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of programs that are not read are told by name, with what to give instead."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from selenite.importers.read import read_reconstruction
from selenite.importers.reconstruction import ReconstructionError

POLYCAM = {f"t_{row}{column}": 0.5 for row in range(3) for column in range(4)}
FILES: list[tuple[str, Any, str]] = [
    ("sfm_data.json", {"sfm_data_version": "0.3", "views": [], "extrinsics": []}, "OpenMVG"),
    ("cameras.sfm", {"featuresFolders": [], "views": [], "poses": []}, "AliceVision"),
    ("scene.mg", {"header": {"pipelineVersion": "2.2"}, "graph": {}}, "Meshroom"),
    ("project.opf", {"format": "application/opf-project+json", "items": []}, "OPF"),
    ("reconstruction.json", [{"cameras": {}, "shots": {}}], "OpenSfM"),
    ("cameras.json", [{"id": 0, "img_name": "a", "fx": 1.0}], "Gaussian splatting"),
    ("1679.json", POLYCAM | {"fx": 1.0}, "Polycam"),
    ("blocks.xml", "<?xml version='1.0'?><BlocksExchange/>", "ContextCapture"),
    ("trajectory.json", {"class_name": "PinholeCameraTrajectory", "parameters": []}, "Open3D"),
    ("doc.xml", '<?xml version="1.0"?><chunk version="1.2.0" label="Chunk 1"/>', "Metashape"),
    ("project.xml", '<document version="1.2.0"><chunks next_id="1"/></document>', "Metashape"),
    ("a.psx", '<document version="1.2.0" path="{projectname}.files/project.zip"/>', "Metashape"),
    ("a.psz", "PK\x03\x04", "Metashape"),
    ("a.zip", "PK\x03\x04", "archive"),
    ("model.nvm", "NVM_V3 \n\n2\n", "NVM"),
    ("mesh.fbx", "Kaydara FBX Binary  ", "FBX"),
    ("mesh.abc", "Ogawa", "Alembic"),
    ("mesh.usdc", "PXR-USDC", "USD"),
    ("mesh.stl", "solid a", "STL"),
    ("scene.blend", "(\xb5/\xfd compressed", "Blender"),
    ("scene", "BLENDER-v405", "Blender"),
]  # fmt: skip


def written(folder: Path, name: str, content: Any) -> Path:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return path


@pytest.mark.parametrize(("name", "content", "program"), FILES, ids=[row[0] for row in FILES])
def test_a_file_of_another_program_is_told(
    tmp_path: Path, name: str, content: Any, program: str
) -> None:
    with pytest.raises(ReconstructionError) as caught:
        read_reconstruction(written(tmp_path, name, content))
    error = caught.value
    assert error.file.endswith(name) and error.cure and "\n" not in str(error)
    assert error.cause.startswith("it is of a kind that is not read: ") and program in error.cause


@pytest.mark.parametrize(
    ("name", "content", "program"),
    [("sfm/cameras.sfm", FILES[1][1], "AliceVision"),
     ("raw/keyframes/corrected_cameras/16.json", POLYCAM, "Polycam")],
)  # fmt: skip
def test_a_folder_of_another_program_is_told(
    tmp_path: Path, name: str, content: Any, program: str
) -> None:
    written(tmp_path, name, content)
    with pytest.raises(ReconstructionError, match=program):
        read_reconstruction(tmp_path / name.partition("/")[0])


def test_what_no_program_is_known_of_is_told_too(tmp_path: Path) -> None:
    for name, content in (("a.txt", "1 2 3"), ("a.json", {"other": 1})):
        with pytest.raises(ReconstructionError, match="format is not known|frames"):
            read_reconstruction(written(tmp_path, name, content))
