# SPDX-License-Identifier: GPL-3.0-or-later
"""What is linked to an input and cannot be looked up is refused by name, with a cure."""

import bpy
import made_scenes as made
import numpy as np
import pytest
from made_images import image

pytestmark = [pytest.mark.blender, pytest.mark.blender34]


def node(material, kind, **settings):
    """A new node of the material."""
    found = material.node_tree.nodes.new(f"ShaderNode{kind}")
    for name, value in settings.items():
        setattr(found, name, value)
    return found


def link(material, output, target="base_color"):
    """Links an output to an input, or to a parameter's."""
    inlet = made.socket(material, target) if isinstance(target, str) else target
    material.node_tree.links.new(output, inlet)


def textured(material, folder, kind="generated8", space="sRGB", mode="STRAIGHT", **settings):
    """An Image Texture on the base colour."""
    found = node(material, "TexImage", image=image(folder, kind, space, mode), **settings)
    link(material, found.outputs["Color"])
    return found


def mapped(material, folder, **settings):
    """A texture behind a Mapping node, which is returned."""
    mapping = node(material, "Mapping", **settings)
    link(material, node(material, "TexCoord").outputs["UV"], mapping.inputs["Vector"])
    link(material, mapping.outputs[0], textured(material, folder).inputs["Vector"])
    return mapping


def separated(material, folder):
    texture = node(material, "TexImage", image=image(folder))
    new = hasattr(bpy.types, "ShaderNodeSeparateColor")
    split = node(material, "SeparateColor" if new else "SeparateRGB")
    link(material, texture.outputs["Color"], split.inputs[0])
    link(material, split.outputs[0], "roughness")


def mixed(material, folder):
    texture = node(material, "TexImage", image=image(folder))
    curve = node(material, "RGBCurve")
    link(material, texture.outputs["Color"], curve.inputs["Color"])
    link(material, curve.outputs["Color"])


def boxed(material, folder):
    textured(material, folder, projection="BOX")


def moved_in_the_sidebar(material, folder):
    textured(material, folder).texture_mapping.translation = (1, 0, 0)


def without_image(material, folder):
    link(material, node(material, "TexImage").outputs["Color"])


def missing_file(material, folder):
    found = bpy.data.images.new("Lost", 4, 4)
    found.source = "FILE"
    found.filepath = str(folder / "nowhere.png")
    link(material, node(material, "TexImage", image=found).outputs["Color"])


def sequence(material, folder):
    textured(material, folder, "file8").image.source = "SEQUENCE"


def other_space(material, folder):
    names = [
        item.identifier
        for item in bpy.types.ColorManagedInputColorspaceSettings.bl_rna.properties[
            "name"
        ].enum_items
    ]
    other = next(name for name in ("Linear ACES", "ACEScg", "Filmic Log", "XYZ") if name in names)
    textured(material, folder, "file8").image.colorspace_settings.name = other


def premultiplied_png(material, folder):
    textured(material, folder, "file8", mode="PREMUL")


def straight_exr(material, folder):
    textured(material, folder, "file32", "Linear", "STRAIGHT")


def not_finite(material, folder):
    found = image(folder, "generated32", "Linear")
    found.pixels[0] = float("nan")
    link(material, node(material, "TexImage", image=found).outputs["Color"])


def generated_coordinates(material, folder):
    found = textured(material, folder)
    coordinates = node(material, "TexCoord")
    link(material, coordinates.outputs["Generated"], found.inputs["Vector"])


def normal_mapping(material, folder):
    mapped(material, folder, vector_type="NORMAL")


def linked_location(material, folder):
    mapping = mapped(material, folder)
    link(material, node(material, "NewGeometry").outputs["Position"], mapping.inputs["Location"])


def of_the_instancer(material, folder):
    found = textured(material, folder)
    link(material, node(material, "UVMap", from_instancer=True).outputs["UV"], found.inputs[0])


def attribute_of_the_object(material, folder):
    link(material, node(material, "Attribute", attribute_type="OBJECT").outputs["Color"])


def edges_as_colour(material, folder):
    link(material, node(material, "Attribute", attribute_name=".edge_verts").outputs["Color"])


@pytest.mark.parametrize(
    "computed",
    [separated, mixed, boxed, generated_coordinates, normal_mapping, linked_location],
)
def test_nodes_between_make_a_program(computed, tmp_path):
    """What no image alone gives is computed; test_node_programs.py compares the values."""
    material = made.material()
    computed(material, tmp_path)
    made.triangle(material=material)
    made.camera()
    values = made.read()
    assert not values.problems
    assert values.materials[0].shader is not None


@pytest.mark.parametrize(
    ("spoil", "cause", "cure"),
    [
        (moved_in_the_sidebar, "Texture Mapping in the sidebar", "Mapping node"),
        (without_image, "node 'Image Texture' (Image Texture) has no image", "choose an image"),
        (missing_file, "nowhere.png' cannot be read", "relink it"),
        (sequence, "its source is sequence", "single image"),
        (other_space, "the colour space of this 8-bit image is", "set it to sRGB"),
        (premultiplied_png, "takes the alpha of this file as Straight", "alpha mode to Straight"),
        (straight_exr, "takes the alpha of this file as Premultiplied", "pack the image"),
        (not_finite, "NaN or infinite pixels", "repair"),
        (of_the_instancer, "takes the coordinates of the instancer", "From Instancer"),
        (attribute_of_the_object, "names no attribute of the geometry", "type to Geometry"),
        pytest.param(
            edges_as_colour,
            "another kind of attribute of that name",
            "colour attribute",
            marks=pytest.mark.skipif(
                bpy.app.version < (3, 6, 0), reason="it has no such attribute"
            ),
        ),
    ],
)
def test_refused(spoil, cause, cure, tmp_path):
    material = made.material()
    spoil(material, tmp_path)
    made.triangle(material=material)
    made.camera()
    problems = made.read().problems
    assert len(problems) == 1, problems
    assert cause in problems[0].cause
    assert cure in problems[0].cure
    assert "Body" in problems[0].line()


def test_texture_is_read_once_and_not_fitted(tmp_path):
    from selenite.scene_read.build import build

    found = image(tmp_path)
    for name in ("Body", "Other"):
        material = made.material(name)
        texture = node(material, "TexImage", image=found)
        link(material, texture.outputs["Color"])
        link(material, texture.outputs["Color"], "roughness")
        made.triangle(name, material)
    bpy.data.objects["Other"].location.z = 1
    made.camera()
    values = made.read()
    assert not values.problems
    assert len({map.texture for item in values.materials for map in item.maps.values()}) == 1
    owner = values.owners["Body"]
    assert "roughness" not in owner.values and "base_color" not in owner.values
    assert owner.fixed["base_color"].startswith("linked to node 'Image Texture'")
    assert owner.fixed["base_color"].endswith(
        ": unlink it to fit one value, or fit base_color_texture"
    )
    scene = build(values)
    with pytest.raises(ValueError, match="Body:roughness comes from image 'made'"):
        scene.with_values({("Body", "roughness"): [0.5]})


def test_fit_and_set_of_a_texture_are_refused(tmp_path):
    from selenite.commands.scene import native_scene
    from selenite.fit.request import UnknownRequest
    from selenite.fit.settings import FitSettings
    from selenite.fit.unknowns import choose
    from selenite.problems import BadInput

    material = made.material()
    textured(material, tmp_path)
    made.triangle(material=material)
    made.camera()
    values = made.read()
    problems = []
    assert not choose(values, [UnknownRequest("Body", "base_color")], FitSettings(), problems, [])
    with pytest.raises(BadInput) as error:
        native_scene(values, {("Body", "base_color"): (0.5,)}, [])
    for problem in (*problems, *error.value.problems):
        assert problem.object == "Parameter 'Body:base_color'"
        assert "linked to node 'Image Texture'" in problem.cause
        assert problem.cure == "unlink it to fit one value, or fit base_color_texture"
    assert len(problems) == len(error.value.problems) == 1


def test_what_the_mesh_lacks_is_warned_of(tmp_path):
    material = made.material()
    found = textured(material, tmp_path)
    link(material, node(material, "UVMap", uv_map="Nowhere").outputs["UV"], found.inputs["Vector"])
    link(material, node(material, "VertexColor").outputs["Color"], "roughness")
    made.triangle(material=material)
    made.camera()
    values = made.read()
    assert not values.problems
    asks = "which material 'Body' asks for; it is taken as 0, as in Cycles"
    assert f"Object 'Body': it has no UV map 'Nowhere', {asks}" in values.warnings
    assert f"Object 'Body': it has no colour attribute, {asks}" in values.warnings


def test_values_that_are_cut_off_and_unsaved_changes_are_warned_of(tmp_path):
    material = made.material()
    link(
        material,
        node(material, "TexImage", image=image(tmp_path, "generated32", "Linear")).outputs["Color"],
    )
    painted = image(tmp_path, "file8")
    painted.pixels[0] = 0.5
    link(material, node(material, "TexImage", image=painted).outputs["Color"], "roughness")
    made.triangle(material=material)
    made.camera()
    values = made.read()
    assert not values.problems
    assert any("'Base Color': values of image 'made' above 1 are cut" in t for t in values.warnings)
    assert any("has changes that are not saved" in text for text in values.warnings)


def test_relative_path(tmp_path):
    """Also after the file is opened from somewhere else."""
    from selenite.scene_read.blend_file import open_blend
    from selenite.scene_read.scene import read_scene

    material = made.material()
    picture = textured(material, tmp_path, "file8").image
    made.triangle(material=material)
    made.camera()
    path = made.save(tmp_path / "scene.blend")
    picture.filepath = f"//{picture.name}"
    made.save(path)
    wanted = made.read().materials[0].maps["base_color"].texture.pixels
    bpy.ops.wm.read_factory_settings(use_empty=True)
    values = read_scene(open_blend(path))
    assert not values.problems
    np.testing.assert_array_equal(values.materials[0].maps["base_color"].texture.pixels, wanted)


@pytest.mark.usefixtures("small_panoramas")
@pytest.mark.parametrize("kind", ["nothing", "moved", "stretched", "uv"])
def test_environment_that_is_not_turned_only_is_evaluated(kind):
    pixels = np.ones((4, 8, 3), np.float32)
    pixels[0] = 3  # at the zenith
    texture = made.environment(made.world(), pixels)
    tree = bpy.context.scene.world.node_tree
    mapping = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeMapping")
    if kind == "nothing":
        tree.links.remove(mapping.inputs["Vector"].links[0])
    elif kind == "moved":
        mapping.inputs["Location"].default_value = (0, 0, 9)
    elif kind == "stretched":
        mapping.inputs["Scale"].default_value = (1, 1, -1)
    else:
        coordinates = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeTexCoord")
        tree.links.new(coordinates.outputs["UV"], texture.inputs["Vector"])
    made.triangle()
    made.camera()
    values = made.read()
    assert not values.problems
    assert any("evaluated by Cycles" in text for text in values.warnings)
    assert "evaluated by Cycles" in values.owners["World"].fixed["rotation"]
    image = values.world.image
    # The middles of the first and the last row of the image; Cycles joins these at the poles.
    top, bottom = image[len(image) // 8].mean(), image[-len(image) // 8].mean()
    if kind in {"nothing", "uv"}:  # one direction for all
        assert image.shape == (1, 1, 3)
    elif kind == "moved":  # all look at the zenith
        assert image.min() > 1.9
    else:
        assert (top, bottom) == pytest.approx((1, 3), abs=0.02)
