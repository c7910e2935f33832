# SPDX-License-Identifier: GPL-3.0-or-later
"""The guide's table of nodes, found by asking the reader for each of them; a test compares the
committed page.

Run as a script, with the Python that has bpy 4.5, it rewrites docs/guide/node_graphs.md.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import bpy

import generated_part

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "guide" / "node_graphs.md"
SCRIPT = Path(__file__).name
VERSION = (4, 5)  # of the Blender whose nodes are listed

#: Module of a maker -> heading.
FAMILIES = {
    "surface": "Shaders",
    "inputs": "Inputs",
    "images": "Images",
    "textures": "Textures",
    "colors": "Colours",
    "arithmetic": "Numbers and vectors",
    "vectors": "Spaces and directions",
    "normals": "Normals",
    "tangents": "Normals",
}
NOT_READ = "Not read"
#: Outputs, containers and nodes of worlds, volumes, hair and other renderers, or of old versions.
LEFT_OUT = (
    "Output",
    "Group",
    "Volume",
    "Eevee",
    "Background",
    "TexSky",
    "UVAlongStroke",
    "Displacement",
    "HairInfo",
    "PointInfo",
    "Squeeze",
)


@dataclass
class Row:
    """A node: its outputs and the values of its settings that are refused, its parameters."""

    title: str
    outputs: list[str] = field(default_factory=list)
    settings: list[str] = field(default_factory=list)
    fitted: list[str] = field(default_factory=list)
    baked: bool = True

    def line(self) -> str:
        """Of the table."""
        but = ", ".join(self.settings + [f"output {name}" for name in self.outputs])
        cells = (
            self.title,
            f"all but {but}" if but else "yes",
            ", ".join(self.fitted) or "-",
            "yes" if self.baked else "no",
        )
        return "| " + " | ".join(cells) + " |"


def kinds() -> Iterator[str]:
    """Types of nodes that a surface may use."""
    for name in sorted(dir(bpy.types)):
        kind = getattr(bpy.types, name)
        if not name.startswith("ShaderNode") or not issubclass(kind, bpy.types.ShaderNode):
            continue
        is_base = kind is bpy.types.ShaderNode or "Legacy" in kind.bl_rna.name
        if not is_base and not any(word in name for word in LEFT_OUT):
            yield name


def _asked(material: bpy.types.Material, node: bpy.types.Node, output: str) -> list[str] | None:
    """Inputs of the node that a fit can change where this output is used; None: it is refused."""
    from selenite.scene_read.shading import materials, nodes
    from selenite.scene_read.shading.textures import EmptyRoom

    tree = material.node_tree
    assert tree is not None  # noqa: S101 - it has nodes
    socket = next(item for item in node.outputs if item.identifier == output)
    end = tree.get_output_node("CYCLES").inputs["Surface"]
    if socket.type == "SHADER":
        tree.links.new(socket, end)
    else:
        emission = tree.nodes["Emission"]
        tree.links.new(emission.outputs[0], end)
        tree.links.new(socket, emission.inputs["Color"])
    found = materials.graph_of(material, EmptyRoom())
    if found.problems:
        return None
    names = (
        source.place[0].name if source.stop < 0 else "color of each stop"
        for source in found.sources.values()
        if source.socket.node == node and not nodes.why_constant_fixed(source, material)
    )
    return list(dict.fromkeys(names))


def _choices(node: bpy.types.Node) -> Iterator[tuple[bpy.types.Property, str, str]]:
    """Each value of each menu of the node: property, identifier, name."""
    base = bpy.types.ShaderNode.bl_rna.properties
    for item in node.bl_rna.properties:
        if item.type == "ENUM" and not item.is_readonly and item.identifier not in base:
            for value in item.enum_items:  # type: ignore[attr-defined]
                yield item, value.identifier, value.name


def row_of(kind: str) -> Row | None:
    """How the node is read; None: not at all."""
    from selenite.scene_read.baking.dependence import NOT_BAKED
    from selenite.scene_read.shading.graph import surface, tree

    title = getattr(bpy.types, kind).bl_rna.name
    if kind in (surface.MIX, surface.ADD):
        return Row(title, fitted=["Fac"] * (kind == surface.MIX), baked=False)
    if kind not in tree.MAKERS and kind not in surface._KINDS:
        return None
    material = bpy.data.materials.new("Page")
    material.use_nodes = True
    assert material.node_tree is not None  # noqa: S101 - it has nodes
    links, nodes = material.node_tree.links, material.node_tree.nodes
    nodes.clear()
    nodes.new("ShaderNodeOutputMaterial")
    nodes.new("ShaderNodeEmission").name = "Emission"
    node = nodes.new(kind)
    node.name = "Page"
    if isinstance(node, bpy.types.ShaderNodeAttribute):
        node.attribute_name = "Col"
    if kind == "ShaderNodeBump":
        noise = nodes.new("ShaderNodeTexNoise")
        links.new(noise.outputs[0], node.inputs["Height"])
    if hasattr(node, "distribution"):  # one that is read, for a start
        node.distribution = "MICROFIBER" if "Sheen" in kind else "GGX"
    row = Row(title, baked=kind not in NOT_BAKED and kind not in surface._KINDS)
    titles = {item.identifier: item.name for item in node.outputs if item.enabled}
    for name, title in titles.items():
        found = _asked(material, node, name)
        if found is None:
            row.outputs.append(title)
        row.fitted += [item for item in found or () if item not in row.fitted]
    if len(row.outputs) == len(titles):
        return None
    read = next(name for name, title in titles.items() if title not in row.outputs)
    for item, value, label in _choices(node):
        before = getattr(node, item.identifier)
        try:
            setattr(node, item.identifier, value)
        except TypeError:  # a menu that offers less than its type
            continue
        ends = [end.identifier for end in node.outputs if end.enabled]
        if _asked(material, node, read if read in ends else ends[0]) is None:
            row.settings.append(f"{item.name} {label}")
        setattr(node, item.identifier, before)
    bpy.data.materials.remove(material)
    return row


def table() -> list[str]:
    """Lines of Markdown: a table for each family, and what is not read."""
    from selenite.scene_read.baking.dependence import NOT_BAKED
    from selenite.scene_read.shading.graph import tree

    families: dict[str, list[Row]] = {title: [] for title in (*FAMILIES.values(), NOT_READ)}
    for kind in kinds():
        row = row_of(kind)
        if row is None:
            title = getattr(bpy.types, kind).bl_rna.name
            is_shader = kind.startswith("ShaderNodeBsdf") or kind == "ShaderNodeHoldout"
            baked = kind not in NOT_BAKED and not is_shader
            families[NOT_READ].append(Row(title, baked=baked))
            continue
        made = tree.MAKERS.get(kind)
        module = "surface" if made is None else made.__module__.rpartition(".")[2]
        families[FAMILIES[module]].append(row)
    lines = []
    for title, rows in families.items():
        lines += ["", f"### {title}", ""]
        rows.sort(key=lambda row: row.title)
        if title == NOT_READ:
            for baked, words in ((True, "Can be baked"), (False, "Cannot be baked")):
                names = ", ".join(row.title for row in rows if row.baked == baked)
                lines.append(f"- {words}: {names}.")
            continue
        lines += ["| node | read | fitted | can be baked |", "|---|---|---|---|"]
        lines += [row.line() for row in rows]
    return [*lines, ""]


def page(text: str) -> str:
    """The page with its table as the reader has it now."""
    return generated_part.replaced(text, SCRIPT, table())


def main() -> None:
    sys.path.insert(0, str(ROOT / "addon"))
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
