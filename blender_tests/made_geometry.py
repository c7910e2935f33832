# SPDX-License-Identifier: GPL-3.0-or-later
"""Geometry that renders otherwise than the viewport shows it, for Blender 3.4 and later."""

import bpy
import made_scenes as made


def cube(name="Body", size=2.0, material=None):
    """A cube at the origin."""
    bpy.ops.mesh.primitive_cube_add(size=size)
    item = bpy.context.object
    item.name = item.data.name = name
    if material is not None:
        item.data.materials.append(material)
    return item


def into_collection(item, name, parent=None):
    """Moves an object into a new collection of its own; returns that."""
    collection = bpy.data.collections.new(name)
    (parent or bpy.context.scene.collection).children.link(collection)
    for other in list(item.users_collection):
        other.objects.unlink(item)
    collection.objects.link(item)
    return collection


def layer_collection(name):
    """What the view layer knows of a collection of the scene."""
    return bpy.context.view_layer.layer_collection.children[name]


def hide(item, how):
    """Hides an object from the viewport in one of the ways there are. `item` is in the scene."""
    if how == "object":
        item.hide_viewport = True
    elif how == "eye":
        bpy.context.view_layer.update()
        item.hide_set(True)
    else:
        collection = into_collection(item, f"Own {item.name}")
        if how == "collection":
            collection.hide_viewport = True
        elif how == "collection eye":
            layer_collection(collection.name).hide_viewport = True
        elif how == "excluded":
            layer_collection(collection.name).exclude = True
        elif how == "collection render":
            collection.hide_render = True
        else:
            raise ValueError(how)


#: Each of them hides from the viewport and not from a render.
VIEWPORT_ONLY = ("object", "eye", "collection", "collection eye")


class Tree:
    """A node tree of geometry on an object: `add` nodes, `link` sockets, `source` and `end`."""

    def __init__(self, item):
        self.tree = bpy.data.node_groups.new("Nodes", "GeometryNodeTree")
        if hasattr(self.tree, "interface"):
            for way in ("INPUT", "OUTPUT"):
                self.tree.interface.new_socket(
                    "Geometry", in_out=way, socket_type="NodeSocketGeometry"
                )
        else:
            self.tree.inputs.new("NodeSocketGeometry", "Geometry")
            self.tree.outputs.new("NodeSocketGeometry", "Geometry")
        self.source = self.add("NodeGroupInput").outputs[0]
        self.end = self.add("NodeGroupOutput").inputs[0]
        item.modifiers.new("Nodes", "NODES").node_group = self.tree

    def add(self, kind):
        """A new node."""
        return self.tree.nodes.new(kind)

    def link(self, output, socket):
        """Links two sockets; a node stands for its first one."""
        output = output.outputs[0] if hasattr(output, "outputs") else output
        socket = socket.inputs[0] if hasattr(socket, "inputs") else socket
        self.tree.links.new(output, socket)


def points(name="Host", places=((-1.5, 0, 0), (0, 0, 0), (1.5, 0, 0)), faces=()):
    """A mesh of vertices alone."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(list(places), [], list(faces))
    return made.add(name, mesh)


def cloud_of_points(name, joined=False):
    """The corners of a cube as points that render; `joined`: joined with the cube."""
    item = cube(name)
    tree = Tree(item)
    dots = tree.add("GeometryNodeMeshToPoints")
    tree.link(tree.source, dots)
    if joined:
        both = tree.add("GeometryNodeJoinGeometry")
        tree.link(tree.source, both)
        tree.link(dots, both)
        dots = both
    tree.link(dots, tree.end)
    return item


def scatter(host, source):
    """Puts instances of an object or a collection on the points of `host`."""
    tree = Tree(host)
    collection = isinstance(source, bpy.types.Collection)
    info = tree.add("GeometryNodeCollectionInfo" if collection else "GeometryNodeObjectInfo")
    info.inputs[0].default_value = source
    if not collection:
        info.inputs["As Instance"].default_value = True
    on_points = tree.add("GeometryNodeInstanceOnPoints")
    tree.link(tree.source, on_points.inputs["Points"])
    made_of = info.outputs[0] if collection else info.outputs["Geometry"]
    tree.link(made_of, on_points.inputs["Instance"])
    tree.link(on_points, tree.end)
    return tree
