# SPDX-License-Identifier: GPL-3.0-or-later
"""glTF files written by hand: Debian's Blender 3.4 cannot export one with a picture."""

import json
import struct
from pathlib import Path

import numpy as np

UNLIT = "KHR_materials_unlit"


def write(
    path: Path,
    positions,
    triangles,
    uvs,
    picture: Path,
    is_lit=True,
    glows=False,
    other=None,
    edit=lambda _: None,
) -> None:
    """One textured mesh, in the axes of the file, with v downward. In a .glb the picture and the
    numbers are inside; beside a .gltf they are in files of their own. is_lit: whether light falls
    on it still, or is in its colours. glows: whether the picture is its light, not its colour.
    other: (triangles, picture) of a second material, beside a .gltf; a second mesh has it too.
    edit: changes the JSON's content."""
    inside = path.suffix == ".glb"
    parts = [np.asarray(positions, "<f4"), np.asarray(uvs, "<f4"), np.asarray(triangles, "<u4")]
    blobs = [part.tobytes() for part in parts] + ([picture.read_bytes()] if inside else [])
    blobs = [blob + bytes(-len(blob) % 4) for blob in blobs]
    starts = np.cumsum([0, *(len(blob) for blob in blobs)]).tolist()
    views = [
        {"buffer": 0, "byteOffset": start, "byteLength": len(blob)}
        for start, blob in zip(starts, blobs, strict=False)
    ]
    low, high = parts[0].min(axis=0).tolist(), parts[0].max(axis=0).tolist()
    accessor = {"bufferView": 0, "componentType": 5126, "count": len(positions), "type": "VEC3"}
    image = {"bufferView": 3, "mimeType": "image/png", "name": picture.stem}
    material = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
    if glows:
        material = {"emissiveTexture": {"index": 0}, "emissiveFactor": [1, 1, 1]}
    content = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "Box"}],
        "meshes": [
            {
                "primitives": [
                    {"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}
                ]
            }
        ],
        "materials": [material | ({} if is_lit else {"extensions": {UNLIT: {}}})],
        "extensionsUsed": [] if is_lit else [UNLIT],
        "textures": [{"source": 0}],
        "images": [image if inside else {"uri": picture.name}],
        "accessors": [
            accessor | {"min": low, "max": high},
            accessor | {"bufferView": 1, "type": "VEC2"},
            {"bufferView": 2, "componentType": 5125, "count": parts[2].size, "type": "SCALAR"},
        ],
        "bufferViews": views,
        "buffers": [{"byteLength": starts[-1]} | ({} if inside else {"uri": f"{path.stem}.bin"})],
    }
    if other is not None:
        _add_other(content, blobs, *other)
    edit(content)
    text, data = json.dumps(content).encode(), b"".join(blobs)
    if not inside:
        path.write_bytes(text)
        path.with_suffix(".bin").write_bytes(data)
        return
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
    chunks += struct.pack("<II", len(data), 0x004E4942) + data
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)


def _add_other(content: dict, blobs: list, triangles, picture: Path) -> None:
    blob, start = np.asarray(triangles, "<u4").tobytes(), sum(map(len, blobs))
    blobs.append(blob)
    content["bufferViews"].append({"buffer": 0, "byteOffset": start, "byteLength": len(blob)})
    content["buffers"][0]["byteLength"] += len(blob)
    number = {"componentType": 5125, "count": len(blob) // 4, "type": "SCALAR"}
    content["accessors"].append({"bufferView": len(content["bufferViews"]) - 1} | number)
    content["images"].append({"uri": picture.name})
    content["textures"].append({"source": 1})
    skin = {"name": "Other", "pbrMetallicRoughness": {"baseColorTexture": {"index": 1}}}
    content["materials"].append(skin)
    part = {"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 1}
    part["indices"] = len(content["accessors"]) - 1
    content["meshes"][0]["primitives"].append(part)
    content["meshes"].append({"primitives": [part]})
    content["nodes"].append({"mesh": 1, "name": "Part"})
    content["scenes"][0]["nodes"].append(1)
