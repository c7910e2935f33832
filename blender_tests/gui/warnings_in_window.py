# SPDX-License-Identifier: GPL-3.0-or-later
"""Warnings of the reader in a real window: with their capture and material, in English and German,
until a later read finds them mended."""

import bpy
from _driving import in_window, made, photographed, picture, run

from selenite.interface import panels, state


def steps():
    """See `_driving.run`."""
    body = made.studio(roughness=0.4)
    made.light(energy=300)
    image = bpy.data.images.new("Bark", 8, 8)
    image.generated_type = "COLOR_GRID"
    texture = body.node_tree.nodes.new("ShaderNodeTexImage")
    texture.image, texture.interpolation = image, "Smart"
    made.link(body, texture.outputs["Color"])
    flat = bpy.data.objects.new("Flat", bpy.data.objects["Body"].data)
    flat.scale = (0, 0, 0)
    bpy.context.scene.collection.objects.link(flat)
    settings = photographed(0.3)
    settings.active_owner = next(
        index for index, item in enumerate(settings.owners) if item.name == "Body"
    )
    known = state.WARNINGS[bpy.context.scene.name]
    assert any("Flat" in text for text in known.of_scene), known
    yield 0.5
    picture("warnings")
    view = bpy.context.preferences.view
    view.language, view.use_translate_interface = "de_DE", True
    yield 0.5
    picture("warnings_german")
    view.language = "en_US"
    flat.scale = (1, 1, 1)
    flat.location.x = 3
    bpy.context.view_layer.update()
    in_window(bpy.ops.selenite.refresh_rows)
    assert not any("Flat" in text for text in known.of_scene), known
    yield 0.5
    picture("mended")


run(steps, panels, {panels.SELENITE_PT_captures, panels.SELENITE_PT_parameters})
