# SPDX-License-Identifier: GPL-3.0-or-later
"""Image files whose alpha says different things, against Cycles, which reads them anew.

Rows as in test_texture_parity.
"""

import bpy
import made_scenes as made
import numpy as np
import pytest
from made_images import linear_name, texels, write_png, write_tga, write_tiff
from strips import NotHere, render_strips, shine, texture

from selenite.cycles_check import render as cycles_render
from selenite.scene_read.shading import images
from selenite.scene_read.shading.nodes import Unreadable

pytestmark = [pytest.mark.blender, pytest.mark.blender34]

MODES = ("STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE")


def values(channels, bits=8):
    """(h, w, channels), alpha last; 16 bits are not twice the 8."""
    found = texels()[..., -channels:]
    return found if bits == 8 else found.astype(np.uint16) * 257 // np.uint16(2) + np.uint16(77)


#: Name -> what writes the file at a path.
FILES = {
    "grey.png": lambda path: write_png(path, values(1)),
    "grey_alpha_8.png": lambda path: write_png(path, values(2)),
    "grey_alpha_16.png": lambda path: write_png(path, values(2, 16)),
    "grey_transparent.png": lambda path: write_png(path, values(1), int(values(1)[1, 2, 0])),
    "rgba_8.png": lambda path: write_png(path, values(4)),
    **{
        f"{name}_{kind}_{bits}.tif": lambda path, n=channels, b=bits, e=extra: write_tiff(
            path, values(n, b), e
        )
        for name, channels in (("grey_alpha", 2), ("rgba", 4))
        for kind, extra in (("unspecified", 0), ("associated", 1), ("straight", 2))
        for bits in (8, 16)
    },
    "rgba.tga": lambda path: write_tga(path, values(4)),
    "rgba_straight.tga": lambda path: write_tga(path, values(4), 3),
    "rgba_associated.tga": lambda path: write_tga(path, values(4), 4),
}
CASES = {}


def shown(material, folder, name, mode, space, linked):
    """An Image Texture of a file; `linked`: its Alpha is linked too, which changes its Color."""
    path = folder / f"{mode}_{space}_{name}"
    FILES[name](path)
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = linear_name() if space == "Linear" else space
    image.alpha_mode = mode
    try:
        images.read_pixels(image)
    except Unreadable as error:
        raise NotHere(error.problem.line()) from error
    node = texture(material, image)
    shine(material, node.outputs["Color"])
    if linked == "linked":
        shine(material, node.outputs["Alpha"], "emission_strength")


for _name in FILES:
    for _mode in MODES:
        for _space in ("sRGB", "Linear", "Non-Color"):
            for _linked in ("alone", "linked"):
                _case = (_name, _mode, _space, _linked)
                CASES["-".join(_case)] = (shown, _case)


@pytest.fixture(scope="module")
def pictures(native, tmp_path_factory):
    """Label of a case -> (ours, Cycles'), or why it is refused."""
    return render_strips(native, tmp_path_factory.mktemp("files"), CASES)


@pytest.mark.without_scene
@pytest.mark.parametrize("label", CASES)
def test_equals_cycles_or_is_refused_by_name(pictures, label):
    result = pictures[label]
    if isinstance(result, str):
        name, mode = label.split("-")[:2]
        assert name in result and result.count(";") == 1  # a cause and a cure
        is_grey_of_3 = "Blender 3" in result and mode != "NONE"
        assert mode in {"STRAIGHT", "PREMUL"} or is_grey_of_3  # the others mean the same in both
        return
    ours, cycles = result
    np.testing.assert_allclose(ours, cycles, rtol=1e-4, atol=2e-5)


@pytest.mark.parametrize(
    ("channels", "is_packed", "alpha"), [(3, False, 0), (1, False, 0), (3, True, 1), (4, False, 1)]
)
def test_open_shading_language_takes_files_without_alpha_for_transparent(
    tmp_path, channels, is_packed, alpha
):
    pixels = np.full((4, 4, channels), 255, np.uint8)
    write_png(tmp_path / "image.png", pixels)
    image = bpy.data.images.load(str(tmp_path / "image.png"))
    if is_packed:
        image.pack()
    material = made.material("Body")
    made.principled(material).inputs["Base Color"].default_value = (0, 0, 0, 1)
    made.socket(material, "emission_strength").default_value = 1
    shine(material, texture(material, image).outputs["Alpha"])
    bpy.ops.mesh.primitive_plane_add(size=40)
    bpy.context.object.data.materials.append(material)
    made.camera(distance=5)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.shading_system = True
    if not bpy.app.build_options.cycles_osl:  # as Debian's Blender
        alpha = 1
    named = [text for text in made.read().warnings if "Open Shading Language" in text]
    assert len(named) == (alpha == 0)
    picture = cycles_render.render(scene, "Camera", (8, 8), 4, 1, tmp_path / "picture.exr")
    assert picture[2:6, 2:6].mean() == pytest.approx(alpha, abs=0.01)
