# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects whose material needs a closed body: what is refused, what is warned of, what is fine."""

import bmesh
import bpy
import made_scenes as made
import numpy as np
import pytest
from command_line import command

from selenite import native
from selenite.scene_read.build import build

pytestmark = [pytest.mark.blender, pytest.mark.blender34]


def fill(material, density=1.0):
    """Gives a material a medium."""
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeVolumePrincipled")
    node.inputs["Density"].default_value = density
    tree.links.new(node.outputs[0], tree.get_output_node("CYCLES").inputs["Volume"])
    return material


def translucent(**values):
    """The studio's ball as glass with a medium in it."""
    return fill(made.studio(transmission=1.0, **values))


def body():
    return bpy.data.objects["Body"]


def open_up(item, faces=1):
    """Deletes the first faces of a mesh object; a UV sphere begins with its quads."""
    mesh = bmesh.new()
    mesh.from_mesh(item.data)
    mesh.faces.ensure_lookup_table()
    bmesh.ops.delete(mesh, geom=mesh.faces[:faces], context="FACES")
    mesh.to_mesh(item.data)
    mesh.free()


def flip(mesh):
    """Turns every face of a mesh round."""
    work = bmesh.new()
    work.from_mesh(mesh)
    bmesh.ops.reverse_faces(work, faces=work.faces)
    work.to_mesh(mesh)
    work.free()


def judged():
    """(lines of problems, warnings, bodies) of the open scene, problems of bodies only."""
    read = made.read()
    return [item.line() for item in read.problems], read.warnings, read.bodies


def test_a_closed_body_is_fine():
    translucent()
    problems, warnings, bodies = judged()
    assert not problems and not warnings
    assert [(item.object, item.material, item.need) for item in bodies] == [
        ("Body", "Body", "medium")
    ]
    assert bodies[0].found.encloses and bodies[0].found.bodies == 1


def test_an_open_body_with_a_medium_is_refused_with_count_and_cure():
    translucent()
    open_up(body())
    (problem,), _, (found,) = judged()
    assert problem.startswith("Object 'Body': the medium of material 'Body'")
    edges = found.found.open_edges
    assert edges in {3, 4} and f"{edges} open edges" in problem
    for words in ("Mesh > Clean Up > Merge by Distance", "Non Manifold", "Fill Holes"):
        assert words in problem
    assert "Recalculate" not in problem


def test_one_face_turned_is_refused_with_its_own_cure():
    translucent()
    body().data.polygons[20].flip()
    (problem,), _, (found,) = judged()
    assert found.found.disagreeing_faces in {1, 2}  # triangles
    assert "wound against" in problem and "Mesh > Normals > Recalculate Outside" in problem
    assert "Merge by Distance" not in problem


def test_a_body_inside_out_is_refused():
    translucent()
    flip(body().data)
    (problem,), _, _ = judged()
    assert "1 body turned inside out" in problem and "Recalculate Outside" in problem


@pytest.mark.parametrize("scale", [(-1, 1, 1), (-1, -2, -0.5), (0.001, 0.001, 0.001)])
def test_mirrored_and_scaled_objects_stay_outside_out(scale):
    translucent()
    body().scale = scale
    assert not judged()[0]
    flip(body().data)
    (problem,), _, _ = judged()
    assert "inside out" in problem


def picture():
    film = native.core().render(build(made.read()), "Camera", 16, 16, 64, seed=5)
    image = film.image.mean(axis=-1, dtype=float)
    error = np.sqrt(np.square(film.standard_error, dtype=float).sum()) / image.size
    return image.mean(), error


@pytest.mark.parametrize("instanced", [False, True])
def test_a_mirrored_object_renders_as_its_original(instanced):
    """Means within 5 standard errors: one false alarm in a million."""
    translucent()
    if instanced:  # a mesh with two users is an instance in its own space
        made.add("Far", body().data).location = (100, 0, 0)
    wanted, noise = picture()
    body().scale = (1, -1, 1)
    mean, error = picture()
    assert abs(mean - wanted) < 5 * np.hypot(noise, error)
    assert error < 0.01 * mean


def test_faces_of_another_material_do_not_end_a_medium():
    translucent()
    other = made.material("Cap", transmission=1.0)
    body().data.materials.append(other)
    for face in body().data.polygons:
        face.material_index = int(face.center.z < 0)
    problems, warnings, bodies = judged()
    assert len(problems) == 1 and "faces of other materials close the body" in problems[0]
    assert "the same material" in problems[0] and "Merge" not in problems[0]
    assert not warnings  # the glass is closed as a whole
    assert {item.need for item in bodies} == {"medium", "glass"}


def test_two_slots_with_one_material_are_one_body():
    material = translucent()
    body().data.materials.append(material)
    for face in body().data.polygons:
        face.material_index = int(face.center.z < 0)
    assert not judged()[0]


def test_every_object_of_a_mesh_is_named_and_each_once():
    translucent()
    open_up(body())
    made.add("Twin", body().data).location = (3, 0, 0)
    source = bpy.data.collections.new("Parts")
    part = bpy.data.objects.new("Part", body().data)
    source.objects.link(part)
    for place in range(3):
        item = made.add(f"Copy {place}", None)
        item.instance_type, item.instance_collection = "COLLECTION", source
        item.location = (0, 3 + place, 0)
    problems, _, _ = judged()
    titles = sorted(text.partition(":")[0] for text in problems)
    assert titles == ["Object 'Body'", "Object 'Part'", "Object 'Twin'"]


def test_the_mesh_counts_as_its_modifiers_leave_it():
    translucent()
    half = body()
    mesh = bmesh.new()
    mesh.from_mesh(half.data)
    lower = [face for face in mesh.faces if face.calc_center_median().z < 0]
    bmesh.ops.delete(mesh, geom=lower, context="FACES")
    mesh.to_mesh(half.data)
    mesh.free()
    assert judged()[0]
    mirror = half.modifiers.new("Mirror", "MIRROR")
    mirror.use_axis = (False, False, True)
    assert not judged()[0]
    mirror.use_mirror_merge = False  # the seam's vertices lie upon each other: still closed
    assert not judged()[0]
    half.modifiers.remove(mirror)
    half.modifiers.new("Solidify", "SOLIDIFY").thickness = 0.1
    assert not judged()[0]


def test_an_open_plane_with_a_medium_is_refused_even_where_it_is_thin():
    fill(made.studio(), density=0.0)
    made.triangle("Sheet", bpy.data.materials["Body"])
    (problem,), _, _ = judged()
    assert problem.startswith("Object 'Sheet'") and "3 open edges" in problem


def test_a_nested_body_is_warned_of_and_a_hollow_is_not():
    translucent()
    inner = body().copy()
    inner.data = body().data.copy()
    inner.data.transform(inner.matrix_world @ inner.matrix_world.Scale(0.5, 4))
    flip(inner.data)
    mesh = bmesh.new()
    mesh.from_mesh(body().data)
    outer = mesh.copy()
    mesh.from_mesh(inner.data)
    mesh.to_mesh(body().data)
    problems, warnings, (found,) = judged()
    assert not problems and not warnings and found.found.bodies == 2
    flip(inner.data)
    outer.from_mesh(inner.data)
    outer.to_mesh(body().data)
    problems, warnings, (found,) = judged()
    assert not problems and found.found.nested == 1
    assert any("hollow" in text for text in warnings)


def test_open_glass_and_subsurface_are_warned_of():
    material = made.studio(transmission=1.0)
    open_up(body())
    problems, warnings, (found,) = judged()
    assert not problems and found.need == "glass"
    assert "open edge" in warnings[0] and "Cycles renders the same" in warnings[0]
    made.socket(material, "transmission").default_value = 0.0
    assert not judged()[2]
    node = made.principled(material)
    weight = next((node.inputs[n] for n in ("Subsurface Weight",) if n in node.inputs), None)
    if weight is None:
        pytest.skip("subsurface scattering is not modelled for this Blender")
    weight.default_value = 0.5
    problems, warnings, (found,) = judged()
    assert not problems and found.need == "subsurface" and "open edge" in warnings[0]


def test_subsurface_scattering_does_not_see_the_winding():
    material = made.studio()
    node = made.principled(material)
    if "Subsurface Weight" not in node.inputs:
        pytest.skip("subsurface scattering is not modelled for this Blender")
    node.inputs["Subsurface Weight"].default_value = 1.0
    flip(body().data)
    problems, warnings, (found,) = judged()
    assert not problems and not warnings and found.found.inside_out == 1


def test_an_opaque_sheet_is_nobodys_business():
    made.studio()
    made.triangle("Sheet", made.material("Paper"))
    problems, warnings, bodies = judged()
    assert not problems and not warnings and not bodies


@pytest.mark.parametrize("name", ["check", "render"])
def test_commands_end_with_status_2(name, tmp_path, capsys):
    translucent()
    open_up(body())
    path, out = made.save(tmp_path / "scene.blend"), tmp_path / "picture.exr"
    more = () if name == "check" else (f"--out={out}", "--spp=1", "--width=8")
    status, report, printed = command(capsys, name, path, *more)
    assert status == 2
    assert "open edges" in printed and "Merge by Distance" in printed
    assert not out.exists()
    if name == "check":
        (found,) = report["bodies"]
        assert found["object"] == "Body" and not found["closed"] and found["open_edges"] in {3, 4}
        assert found["fault"] == " ".join(found["fault"].split())
        assert report["model"].startswith("volume") and "'Body'" in report["model"]
