# SPDX-License-Identifier: GPL-3.0-or-later
"""Shader nodes and mixtures of them against Cycles: flat squares without noise, and spheres."""

import sys
from pathlib import Path

import bpy
import made_scenes as made
import numpy as np
import pytest
from mathutils import Vector
from strips import render_both

from selenite.scene_read.build import build

pytestmark = pytest.mark.blender

ROWS = 4
COLOR = (0.7, 0.5, 0.2)
TANGENT = (0.8, 0.5, 0.1)
#: Label -> node, its settings, its inputs.
NODES = {
    "lambert": ("Diffuse", {}, {"Color": COLOR}),
    "rough diffuse": ("Diffuse", {}, {"Color": COLOR, "Roughness": 0.6}),
    "glossy": ("Glossy", {"distribution": "GGX"}, {"Color": COLOR, "Roughness": 0.5}),
    "glossy multi": ("Glossy", {"distribution": "MULTI_GGX"}, {"Color": COLOR, "Roughness": 0.7}),
    "glass": ("Glass", {"distribution": "GGX"}, {"Color": COLOR, "Roughness": 0.3, "IOR": 1.4}),
    "glass multi": (
        "Glass",
        {"distribution": "MULTI_GGX"},
        {"Color": COLOR, "Roughness": 0.4, "IOR": 1.6},
    ),
    "refraction": (
        "Refraction",
        {"distribution": "GGX"},
        {"Color": COLOR, "Roughness": 0.3, "IOR": 1.3},
    ),
    "glossy beckmann": (
        "Glossy",
        {"distribution": "BECKMANN"},
        {"Color": COLOR, "Roughness": 0.5},
    ),
    "glossy ashikhmin": (
        "Glossy",
        {"distribution": "ASHIKHMIN_SHIRLEY"},
        {"Color": COLOR, "Roughness": 0.5},
    ),
    "glossy stretched": (
        "Glossy",
        {"distribution": "MULTI_GGX"},
        {"Color": COLOR, "Roughness": 0.6, "Anisotropy": 0.7, "Rotation": 0.15, "Tangent": TANGENT},
    ),
    "glass beckmann": (
        "Glass",
        {"distribution": "BECKMANN"},
        {"Color": COLOR, "Roughness": 0.5, "IOR": 1.4},
    ),
    "refraction beckmann": (
        "Refraction",
        {"distribution": "BECKMANN"},
        {"Color": COLOR, "Roughness": 0.5, "IOR": 1.3},
    ),
    "translucent": ("Translucent", {}, {"Color": COLOR}),
    "transparent": ("Transparent", {}, {"Color": COLOR}),
    "metallic": (
        "Metallic",
        {"fresnel_type": "F82"},
        {"Base Color": COLOR, "Edge Tint": (0.4, 0.8, 1.0), "Roughness": 0.4},
    ),
    "conductor": (
        "Metallic",
        {"fresnel_type": "PHYSICAL_CONDUCTOR"},
        {"IOR": (0.2, 2.5, 1.0), "Extinction": (3.9, 3.0, 0.5), "Roughness": 0.4},
    ),
    "metallic stretched": (
        "Metallic",
        {"fresnel_type": "F82", "distribution": "BECKMANN"},
        {
            "Base Color": COLOR,
            "Edge Tint": (0.4, 0.8, 1.0),
            "Roughness": 0.5,
            "Anisotropy": 0.6,
            "Tangent": TANGENT,
        },
    ),
    "principled stretched": (
        "Principled",
        {"distribution": "MULTI_GGX"},
        {
            "Base Color": COLOR,
            "Metallic": 0.3,
            "Roughness": 0.5,
            "Transmission Weight": 0.3,
            "Coat Weight": 0.4,
            "Coat Roughness": 0.3,
            "Anisotropic": 0.7,
            "Anisotropic Rotation": 0.15,
            "Tangent": TANGENT,
        },
    ),
    "principled filmed": (
        "Principled",
        {"distribution": "MULTI_GGX"},
        {
            "Base Color": COLOR,
            "Metallic": 0.3,
            "Roughness": 0.5,
            "Transmission Weight": 0.5,
            "Specular IOR Level": 0.3,
            "Specular Tint": (0.9, 1.0, 0.6),
            "Coat Weight": 0.2,
            "Thin Film Thickness": 380.0,
            "Thin Film IOR": 1.7,
        },
    ),
    "principled coated": (
        "Principled",
        {"distribution": "MULTI_GGX"},
        {
            "Base Color": COLOR,
            "Metallic": 0.3,
            "Roughness": 0.5,
            "Coat Weight": 0.7,
            "Coat Roughness": 0.3,
            "Coat Tint": (0.3, 0.9, 0.6),
        },
    ),
    "sheen": ("Sheen", {"distribution": "MICROFIBER"}, {"Color": COLOR, "Roughness": 0.4}),
    "subsurface": (
        "Subsurface",
        {"falloff": "RANDOM_WALK"},
        {"Color": COLOR, "Scale": 0.2, "Radius": (1.0, 0.5, 0.2), "Roughness": 0.7},
    ),
    "emission": ("Emission", {}, {"Color": COLOR, "Strength": 0.3}),
}
#: Two or three of them with their shares: Mix Shader of the first, and of the rest.
MIXTURES = {
    "diffuse, glossy": ((0.3, "lambert"), (0.7, "glossy")),
    "diffuse, glass, translucent": ((0.3, "lambert"), (0.4, "glass"), (0.3, "translucent")),
    "transparent, metallic, sheen": ((0.4, "transparent"), (0.4, "metallic"), (0.2, "sheen")),
    "emission, diffuse": ((0.2, "emission"), (0.8, "rough diffuse")),
}
_IDNAMES = {"Emission": "ShaderNodeEmission", "Subsurface": "ShaderNodeSubsurfaceScattering"}


def shader(tree, label):
    kind, settings, values = NODES[label]
    node = tree.nodes.new(_IDNAMES.get(kind, f"ShaderNodeBsdf{kind}"))
    for name, value in settings.items():
        setattr(node, name, value)
    for name, value in values.items():
        socket = next(item for item in node.inputs if item.name == name)
        if name == "Tangent":
            vector = tree.nodes.new("ShaderNodeCombineXYZ")
            for part, number in zip(vector.inputs, value, strict=True):
                part.default_value = number
            tree.links.new(vector.outputs[0], socket)
            continue
        socket.default_value = (*value, 1.0) if socket.type == "RGBA" else value
    return node


def surface(label):
    """A material of one of NODES or MIXTURES."""
    material = bpy.data.materials.new(label)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.remove(made.principled(material))
    parts = MIXTURES.get(label, ((1.0, label),))
    left = sum(share for share, _ in parts)
    output = tree.get_output_node("CYCLES").inputs["Surface"]
    for share, name in parts[:-1]:
        mix = tree.nodes.new("ShaderNodeMixShader")
        mix.inputs[0].default_value = 1 - share / left
        left -= share
        tree.links.new(shader(tree, name).outputs[0], mix.inputs[1])
        tree.links.new(mix.outputs[0], output)
        output = mix.inputs[2]
    tree.links.new(shader(tree, parts[-1][1]).outputs[0], output)
    return material


def square(x, material):
    """A column of the picture; four pixels are the least that Blender renders."""
    mesh = bpy.data.meshes.new(material.name)
    corners = [(x, 0, 0), (x + 1, 0, 0), (x + 1, ROWS, 0), (x, ROWS, 0)]
    mesh.from_pydata(corners, [], [range(4)])
    mesh.materials.append(material)
    made.add(material.name, mesh)


def sun(turn):
    lamp = made.light("Sun", "SUN", energy=2.0, angle=0.0)
    lamp.rotation_euler = turn


@pytest.mark.parametrize("turn", [(0.5, -0.3, 0.4), (2.6, 0.2, 0.4)], ids=["above", "below"])
def test_squares_under_a_sun_are_those_of_cycles(native, empty_scene, tmp_path, turn):
    # An emission would be a second lamp, between which samples choose.
    labels = [name for name in NODES if name not in {"subsurface", "emission"}]
    for x, label in enumerate(labels):
        square(x, surface(label))
    sun(turn)
    ours, cycles = render_both(native, tmp_path, (len(labels), ROWS), 1)
    bright = [label for label, value in zip(labels, cycles[1], strict=True) if value.max() > 0]
    assert len(bright) >= 4
    for label, mine, value in zip(labels, ours[1], cycles[1], strict=True):
        np.testing.assert_allclose(mine, value, rtol=1e-4, atol=1e-6, err_msg=label)


@pytest.mark.parametrize("turn", [(0.5, -0.3, 0.4), (2.6, 0.2, 0.4)], ids=["above", "below"])
def test_squares_whose_normals_point_out_of_their_backs_are_those_of_cycles(
    native, empty_scene, tmp_path, turn
):
    labels = ["lambert", "rough diffuse", "glossy", "glass", "translucent", "metallic", "sheen"]
    labels += ["principled stretched", "principled filmed", "principled coated"]
    for x, label in enumerate(labels):
        square(x, surface(label))
        mesh = bpy.data.meshes[label]
        mesh.normals_split_custom_set([(0.2, 0.1, -0.97)] * len(mesh.loops))
    sun(turn)
    ours, cycles = render_both(native, tmp_path, (len(labels), ROWS), 1)
    for label, mine, value in zip(labels, ours[1], cycles[1], strict=True):
        if label in {"glossy", "glass", "metallic"}:
            assert value.max() == 0, label
        np.testing.assert_allclose(mine, value, rtol=1e-4, atol=1e-6, err_msg=label)


@pytest.mark.parametrize("toward", [(0.98, 0.0, -0.2), (-0.9, 0.0, 0.1)], ids=["below", "above"])
def test_light_on_one_side_of_the_face_and_the_other_of_its_normal_is_that_of_cycles(
    native, empty_scene, tmp_path, toward
):
    labels = [name for name in NODES if name not in {"subsurface", "emission"}]
    for x, label in enumerate(labels):
        square(x, surface(label))
        mesh = bpy.data.meshes[label]
        mesh.normals_split_custom_set([(0.6, 0.0, 0.8)] * len(mesh.loops))
    sun((-Vector(toward)).to_track_quat("-Z", "Y").to_euler())
    ours, cycles = render_both(native, tmp_path, (len(labels), ROWS), 1)
    assert sum(value.max() > 0 for value in cycles[1]) >= 3
    for label, mine, value in zip(labels, ours[1], cycles[1], strict=True):
        np.testing.assert_allclose(mine, value, rtol=1e-4, atol=1e-6, err_msg=label)


@pytest.mark.parametrize("label", [*NODES, *MIXTURES])
def test_spheres_are_those_of_cycles(native, empty_scene, tmp_path, label):
    """The mean of a picture of a sphere under an even sky; its noise is below 0.2 %."""
    sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "scenes"))
    from example_scene import set_comparison

    made.sphere("Body", surface(label), segments=32)
    made.camera(type="ORTHO", ortho_scale=2.4, sensor_fit="HORIZONTAL")
    made.world((1.0, 1.0, 1.0))
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 8, 8
    set_comparison(scene, 2048)
    file = scene.render.image_settings
    file.file_format, file.color_mode, file.color_depth = "OPEN_EXR", "RGB", "32"
    scene.render.filepath = str(tmp_path / "cycles.exr")
    values = made.read()
    assert not values.problems
    ours = native.core().render(build(values), "Camera", 8, 8, 2048).image
    bpy.ops.render.render(write_still=True)
    cycles = native.image().read(scene.render.filepath)[0]
    for channel in range(3):
        assert ours[..., channel].mean() == pytest.approx(cycles[..., channel].mean(), rel=0.005)
