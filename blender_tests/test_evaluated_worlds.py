# SPDX-License-Identifier: GPL-3.0-or-later
"""Worlds made of nodes, which Cycles evaluates to panoramas: Selenite against Cycles, and what a
reading says of them and leaves behind.

Whole pictures of a ball under the world alone, judged as in `./dev bench parity`; a new seed would
raise a false alarm once in about 500 runs of this file.
"""

import bpy
import made_scenes as made
import numpy as np
import parity_cases as parity
import pytest

from selenite.cycles_check import render as cycles_render
from selenite.scene_read.shading import panorama
from selenite.scene_read.shading.panorama import sizes
from selenite.scene_read.shading.world import evaluate

pytestmark = [pytest.mark.blender, pytest.mark.slow]

EFFORT = parity.Effort(samples=32, seeds=4, native_samples=256, rounds=1)
SIZE = 32
BLUE = (0.1, 0.3, 0.6, 1.0)


class World:
    """The world of the open scene, and its nodes."""

    def __init__(self):
        self.world = bpy.context.scene.world
        self.tree = self.world.node_tree
        self.background = self.tree.nodes["Background"]
        self.output = next(n for n in self.tree.nodes if n.type == "OUTPUT_WORLD")

    def new(self, kind, **settings):
        node = self.tree.nodes.new(f"ShaderNode{kind}")
        for name, value in settings.items():
            setattr(node, name, value)
        return node

    def link(self, output, target):
        self.tree.links.new(output, target)

    def second(self, color=BLUE, strength=1.0):
        node = self.new("Background")
        node.inputs["Color"].default_value = color
        node.inputs["Strength"].default_value = strength
        return node

    def show(self, node):
        self.link(node.outputs[0], self.output.inputs["Surface"])

    def mix(self, factor, second):
        node = self.new("MixShader")
        self.link(factor, node.inputs[0])
        self.link(self.background.outputs[0], node.inputs[1])
        self.link(second.outputs[0], node.inputs[2])
        self.show(node)
        return node

    def ray(self, output="Is Camera Ray"):
        return self.new("LightPath").outputs[output]

    def image(self, **settings):
        return self.new("TexEnvironment", image=picture(), **settings)


def picture():
    rng = np.random.default_rng(3)
    pixels = np.ones((16, 32, 4), np.float32)
    pixels[..., :3] = 2 * rng.random((16, 32, 3)) ** 2
    image = bpy.data.images.new("Around", 32, 16, float_buffer=True)
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    return image


@pytest.fixture
def world():
    """A ball of plastic under a grey world of strength 0.8."""
    return scene_of()


def scene_of(**values):
    parity.make(
        parity.Case("", "sky", {"base_color": (0.7, 0.4, 0.2), "roughness": 0.4} | values), SIZE
    )
    bpy.data.worlds.remove(bpy.context.scene.world)
    made.sample_coarsely(made.world((0.5, 0.5, 0.5), strength=0.8))
    return World()


# ---- against Cycles


def _gradient(w):
    ramp, split = w.new("ValToRGB"), w.new("SeparateXYZ")
    w.link(w.new("TexCoord").outputs["Generated"], split.inputs[0])
    w.link(split.outputs[2], ramp.inputs[0])
    ramp.color_ramp.elements[0].color = (0.05, 0.1, 0.2, 1)
    w.link(ramp.outputs[0], w.background.inputs["Color"])


def _mirror_ball(w):
    w.link(w.image(projection="MIRROR_BALL").outputs[0], w.background.inputs["Color"])


def _stretched(w):
    mapping, image = w.new("Mapping"), w.image()
    mapping.inputs["Scale"].default_value = (1, 1.5, 0.4)
    mapping.inputs["Location"].default_value = (0.2, 0, 0.1)
    w.link(w.new("TexCoord").outputs["Generated"], mapping.inputs[0])
    w.link(mapping.outputs[0], image.inputs[0])
    w.link(image.outputs[0], w.background.inputs["Color"])


def _mixed(w):
    mix = w.new("MixRGB")
    mix.inputs[0].default_value = 0.4
    mix.inputs[2].default_value = BLUE
    w.link(w.image().outputs[0], mix.inputs[1])
    w.link(mix.outputs[0], w.background.inputs["Color"])


def _emission(w):
    node = w.new("Emission")
    w.link(w.image().outputs[0], node.inputs["Color"])
    node.inputs["Strength"].default_value = 0.6
    w.show(node)


def _added(w):
    added, second = w.new("AddShader"), w.second(strength=0.4)
    w.link(w.image().outputs[0], w.background.inputs["Color"])
    w.link(w.background.outputs[0], added.inputs[0])
    w.link(second.outputs[0], added.inputs[1])
    w.show(added)


def _hosek(w):
    sky = w.new("TexSky", sky_type="HOSEK_WILKIE", sun_direction=(0.5, -0.3, 0.6))
    w.link(sky.outputs[0], w.background.inputs["Color"])


def _stars(w):
    noise, ramp = w.new("TexNoise"), w.new("ValToRGB")
    noise.inputs["Scale"].default_value = 100
    ramp.color_ramp.elements[0].position, ramp.color_ramp.elements[1].position = 0.62, 0.7
    ramp.color_ramp.elements[1].color = (9, 9, 9, 1)
    w.link(w.new("TexCoord").outputs["Generated"], noise.inputs["Vector"])
    w.link(noise.outputs[0], ramp.inputs[0])
    w.link(ramp.outputs[0], w.background.inputs["Color"])


def _sun(w):
    sky = w.new("TexSky", sun_elevation=0.6, sun_rotation=2.8)
    names = [item.identifier for item in sky.bl_rna.properties["sky_type"].enum_items]
    sky.sky_type = next(name for name in ("NISHITA", "SINGLE_SCATTERING") if name in names)
    w.link(sky.outputs[0], w.background.inputs["Color"])
    w.background.inputs["Strength"].default_value = 0.02


def _camera_color(w):
    w.link(w.image().outputs[0], w.background.inputs["Color"])
    w.mix(w.ray(), w.second())


def _camera_image(w):
    second = w.second()
    w.link(w.image().outputs[0], second.inputs["Color"])
    w.mix(w.ray(), second)


def _camera_in_color(w):
    mix = w.new("MixRGB")
    mix.inputs[1].default_value, mix.inputs[2].default_value = (0.9, 0.8, 0.5, 1), BLUE
    w.link(w.ray(), mix.inputs[0])
    w.link(mix.outputs[0], w.background.inputs["Color"])


def _in_group(w):
    group = bpy.data.node_groups.new("Rays", "ShaderNodeTree")
    if hasattr(group, "interface"):
        group.interface.new_socket("Seen", in_out="OUTPUT", socket_type="NodeSocketFloat")
    else:
        group.outputs.new("NodeSocketFloat", "Seen")
    path, end = group.nodes.new("ShaderNodeLightPath"), group.nodes.new("NodeGroupOutput")
    group.links.new(path.outputs["Is Camera Ray"], end.inputs[0])
    _gradient(w)
    w.mix(w.new("Group", node_tree=group).outputs[0], w.second())


def _glossy(w):
    w.mix(w.ray("Is Glossy Ray"), w.second())


def _glossy_images(w):
    second, other = w.second(), w.image()
    w.link(w.image().outputs[0], w.background.inputs["Color"])
    other.image = other.image.copy()
    other.image.scale(8, 4)
    w.link(other.outputs[0], second.inputs["Color"])
    w.mix(w.ray("Is Glossy Ray"), second)


def _reflection(w):
    w.mix(w.ray("Is Reflection Ray"), w.second())


def _transmission(w):
    w.mix(w.ray("Is Transmission Ray"), w.second())


#: Of whose panoramas a quarter of the columns would lose something.
PARTS = {_stars: 2, _sun: 1}
GLASS = {"transmission": 1.0, "base_color": (0.9, 0.9, 0.9)}
METAL = {"metallic": 1.0}


@pytest.mark.parametrize(
    ("make", "values"),
    [
        (_gradient, {}),
        (_mirror_ball, {}),
        (_stretched, {}),
        (_mixed, {}),
        (_emission, {}),
        (_added, {}),
        (_hosek, {}),
        (_stars, {}),
        (_sun, {}),
        (_camera_color, {}),
        (_camera_image, GLASS | {"roughness": 0.0}),
        (_camera_in_color, {}),
        (_in_group, {}),
        (_glossy, METAL),
        (_glossy_images, METAL),
        (_reflection, {}),
        (_transmission, GLASS | {"roughness": 0.1}),
    ],
)
def test_a_picture_under_it_is_that_of_cycles(make, values, tmp_path, monkeypatch):
    made.shrink_panoramas(monkeypatch, PARTS.get(make, 4))
    make(scene_of(**values))
    everywhere = np.ones((SIZE, SIZE), bool)
    verdict, ours, cycles = parity.compare(everywhere, tmp_path, EFFORT)
    assert verdict.passed, verdict
    np.testing.assert_allclose(ours.mean.mean(), cycles.mean.mean(), rtol=0.02)


# ---- what a reading says


def _said(values):
    return [text for text in values.warnings if "evaluated by Cycles" in text]


def test_what_is_constant_or_a_plain_image_is_read_as_before(world):
    world.link(world.image().outputs[0], world.background.inputs["Color"])
    values = made.read()
    assert values.world.image.shape == (16, 32, 3)
    assert not _said(values)
    assert not values.world.backdrops


@pytest.mark.parametrize(("radiance", "is_black"), [(1e16, False), (1e21, True)])
def test_a_light_too_bright_for_cycles_is_named(world, tmp_path, radiance, is_black):
    node = world.image()
    pixels = np.full((16, 32, 4), radiance, np.float32)
    node.image.pixels.foreach_set(pixels.ravel())
    node.image.pack()
    world.link(node.outputs[0], world.background.inputs["Color"])
    named = [text for text in made.read().warnings if "Cycles shows all surfaces black" in text]
    assert len(named) == is_black
    path = tmp_path / "picture.exr"
    picture = cycles_render.render(bpy.context.scene, "Camera", (24, 24), 4, 1, path)
    ball = picture[10:14, 10:14]
    assert (ball.max() == 0) if is_black else (ball.min() > 0.01 * radiance)


@pytest.mark.blender34
def test_the_strength_of_a_lone_background_stays_a_parameter(world):
    _gradient(world)
    values = made.read()
    assert values.world.strength == pytest.approx(0.8)
    assert "strength" not in values.owners["World"].fixed
    assert "Ramp" in values.owners["World"].fixed["color"]
    # At the zenith the ramp ends at white: its strength is not in the panorama.
    assert values.world.image[0].max() == pytest.approx(1, abs=0.01)
    (text,) = _said(values)
    assert text == (
        "World 'Studio': its nodes are evaluated by Cycles to a panorama of 2048 x 1024 pixels"
    )


def test_a_mixture_of_shaders_has_no_parameter(world):
    _added(world)
    owner = made.read().owners["World"]
    assert {"strength", "color", "rotation"} <= set(owner.fixed)
    assert "Add Shader" in owner.fixed["strength"]
    assert owner.values["strength"] == (1.0,)


def test_the_camera_sees_a_colour_of_its_own_and_the_rest_stays_fitted(world):
    _camera_color(world)
    values = made.read()
    (seen,) = values.world.backdrops
    assert seen.kinds == ("camera",)
    np.testing.assert_allclose(seen.image, np.float32([[BLUE[:3]]]))
    assert not seen.scaled
    owner = values.owners["World"]
    assert not {"strength", "rotation"} & set(owner.fixed)
    assert not _said(values)


@pytest.mark.blender34
def test_one_strength_scales_what_camera_and_light_samples_see(world):
    _camera_in_color(world)
    values = made.read()
    (seen,) = values.world.backdrops
    assert seen.scaled
    assert values.world.strength == pytest.approx(0.8)
    np.testing.assert_allclose(values.world.image, np.float32([[(0.9, 0.8, 0.5)]]), rtol=1e-6)
    np.testing.assert_allclose(seen.image, np.float32([[BLUE[:3]]]), rtol=1e-6)


@pytest.mark.parametrize(
    ("output", "named"), [("Ray Depth", "Light Path"), ("Is Singular Ray", "Light Path")]
)
def test_what_tells_more_than_kinds_of_rays_is_refused_by_name(world, output, named):
    world.mix(world.ray(output), world.second())
    lines = [item.line() for item in made.read().problems]
    assert any(named in line and output in line for line in lines), lines


def test_what_depends_on_the_camera_is_refused_by_name(world):
    world.link(world.new("TexCoord").outputs["Window"], world.background.inputs["Color"])
    lines = [item.line() for item in made.read().problems]
    assert any("Texture Coordinate" in line and "Window" in line for line in lines), lines


def test_two_sun_discs_are_refused_by_name(world):
    _sun(world)
    _, sky = world.new("TexSky"), next(n for n in world.tree.nodes if n.type == "TEX_SKY")
    other = world.tree.nodes[-1]
    other.sky_type = sky.sky_type
    second = world.second()
    world.link(other.outputs[0], second.inputs["Color"])
    added = world.new("AddShader")
    world.link(world.background.outputs[0], added.inputs[0])
    world.link(second.outputs[0], added.inputs[1])
    world.show(added)
    assert any("sun disc" in item.line() for item in made.read().problems)


# ---- what it leaves behind


@pytest.mark.blender34
def test_nothing_is_left_in_the_file(world):
    _in_group(world)
    # Blender 3 counts a user too many of what stands in the scene's own collection after each copy.
    counts = bpy.app.version >= (4, 0)

    def blocks():
        found = bpy.data.user_map()
        return sorted((type(item).__name__, item.name, counts and item.users) for item in found)

    before = blocks()
    links = len(world.tree.links)
    made.read()
    assert blocks() == before
    assert len(world.tree.links) == links
    assert world.background.inputs["Strength"].default_value == pytest.approx(0.8)


@pytest.mark.blender34
def test_it_is_evaluated_once_until_something_changes(world, monkeypatch):
    _gradient(world)
    scene = bpy.context.scene
    (first,) = evaluate(scene, world.world).panoramas.values()
    (again,) = evaluate(scene, world.world).panoramas.values()
    assert again is first
    ramp = next(n for n in world.tree.nodes if n.type == "VALTORGB")
    ramp.color_ramp.elements[0].color = (0.9, 0.1, 0.2, 1)
    (changed,) = evaluate(scene, world.world).panoramas.values()
    assert changed is not first
    assert changed.pixels[-1, 0, 0] == pytest.approx(0.9, abs=0.01)


# ---- sizes


def test_an_even_panorama_is_one_pixel_and_a_smooth_one_few():
    height = np.linspace(0, np.pi, 1024, dtype=np.float32)[:, None, None]
    assert sizes.reduced(np.full((1024, 2048, 3), 0.3, np.float32)).shape == (1, 1, 3)
    smooth = np.broadcast_to(2 + np.cos(height), (1024, 2048, 3)).astype(np.float32)
    small = sizes.reduced(smooth)
    assert small.shape[1] <= 256
    assert small.mean() == pytest.approx(smooth.mean(), rel=1e-5)


def test_noise_between_pixels_is_detail_and_a_gradient_is_none():
    rng = np.random.default_rng(1)
    assert sizes.is_detailed(rng.random((64, 128, 3), np.float32))
    assert not sizes.is_detailed(np.ones((64, 128, 3), np.float32))
    assert not sizes.is_detailed(np.zeros((64, 128, 3), np.float32))


def test_light_samples_are_of_no_kind():
    assert not panorama.LIGHT.kinds
    assert all(rays.kinds for rays in panorama.OTHERS)
