# SPDX-License-Identifier: GPL-3.0-or-later
"""Small valid reconstructions, a folder for each format, and what of a folder is read."""

from __future__ import annotations

import gzip
import struct
from pathlib import Path

#: What is read of each folder: a file of it, or the folder itself.
MAIN = {
    "metashape": "cameras.xml",
    "x3d": "scene.x3d",
    "compressed": "scene.x3dz",
    "colmap_text": "",
    "colmap_binary": "",
    "nerf": "transforms.json",
    "xmp": "",
    "csv": "cameras.csv",
    "bundler": "bundle.out",
    "ply_text": "scan.ply",
    "ply_binary": "scan.ply",
}
IDENTITY = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"
SIZE = '<resolution width="12" height="12"/>'
METASHAPE = f"""<?xml version="1.0" encoding="UTF-8"?>
<document version="2.0.0"><chunk label="C" enabled="true">
<sensors><sensor id="0" type="frame">{SIZE}<calibration type="frame" class="adjusted">{SIZE}
<f>10.5</f><cx>.5</cx><cy>-1</cy><b1>1e-1</b1><b2>.01</b2><k1>-.1</k1><k4>.01</k4><p1>.001</p1>
</calibration></sensor><sensor id="1" type="frame">{SIZE}
<property name="pixel_width" value="0.1"/><property name="focal_length" value="5"/></sensor>
<sensor id="2" type="fisheye">{SIZE}</sensor><sensor id="3" master_id="0" type="frame">{SIZE}
<property name="pixel_width" value="0.1"/><property name="focal_length" value="5"/>
<rotation>1 0 0 0 1 0 0 0 1</rotation><location fixed="true"/></sensor></sensors>
<components active_id="0"><component id="0"><transform><rotation>1 0 0 0 1 0 0 0 1</rotation>
<translation>1e6 2 3</translation><scale>0.5</scale></transform><region><center>0 0 0</center>
<size>1 2 3</size><R>1 0 0 0 1 0 0 0 1</R></region></component></components>
<cameras><camera id="0" sensor_id="0" component_id="0" label="a"><transform>{IDENTITY}</transform>
</camera><group id="0"><camera id="1" sensor_id="1" component_id="0" label="b">
<transform>{IDENTITY}</transform></camera></group><group id="1" label="g"><camera id="3"
sensor_id="3" master_id="0" label="a"/></group><camera id="2" sensor_id="2" label="c"/></cameras>
<transform>{IDENTITY}</transform><reference>GEOGCS["WGS 84"]</reference></chunk></document>
"""
X3D = """<X3D version="3.3"><head><unit category="length" conversionFactor="0.01"/></head><Scene>
<Transform DEF="T" translation="1 2 3" rotation="0 0 1 0.5" scale="2 2 2" center="1 0 0"
 scaleOrientation="1 0 0 1"><Viewpoint description="A" position="0 0 3" orientation="1 0 0 .2"
 fieldOfView="0.8"/><Shape DEF="S"><Appearance DEF="L"><Material/><ImageTexture
 url='"gone.png" "photo.png"'/></Appearance><IndexedFaceSet ccw="false"
 coordIndex="0 1 2 3 -1 0 1 2"
 texCoordIndex="0 1 2 0 -1 0 1 2" normalPerVertex="false" normalIndex="0 0"><Coordinate
 point="0 0 0, 1 0 0, 1 1 0, 0 1 0"/><TextureCoordinate point="0 0 1 0 1 1"/><Normal
 vector="0 0 1"/><Color color="1 0 0 0 1 0 0 0 1 1 1 1"/></IndexedFaceSet></Shape></Transform>
<Switch whichChoice="0"><Group DEF="G"><Shape USE="S"/></Group></Switch><Group USE="G"/>
<Shape><Appearance USE="L"/><IndexedTriangleSet index="0 1 2"><Coordinate DEF="P"
 point="0 0 0 1 0 0 1 1 0"/></IndexedTriangleSet></Shape><Viewpoint DEF="B"/>
<Shape><TriangleSet><Coordinate USE="P"/></TriangleSet></Shape><Inline url="x"/></Scene></X3D>
"""
COLMAP = {
    "cameras.txt": "# c\n1 OPENCV 12 12 10 11 6 5 .1 .2 .01 .02\n2 FOV 12 12 10 10 6 6 1\n",
    "images.txt": "1 1 0 0 0 0 0 4 1 a.png\n1 2 -1\n2 .5 .5 .5 .5 1 2 3 1 b c.png\n\n"
    "3 1 0 0 0 0 0 0 2 d.png\n\n",
    "points3D.txt": "7 1 2 3 255 0 9 .5 1 0\n",
    "rigs.txt": "1 2 CAMERA 1 CAMERA 2 1 1 0 0 0 1 0 0\n",
    "frames.txt": "1 1 1 0 0 0 0 0 4 2 CAMERA 1 1 CAMERA 2 3\n",
}
NERF = """{"camera_model": "OPENCV", "w": 12, "h": 12, "fl_x": 10.5, "fl_y": 11, "cx": 6, "k1": 0.1,
"k4": 0.01, "p1": 0.001, "ply_file_path": "points.ply",
"frames": [{"file_path": "photo.png", "transform_matrix":
[[1,0,0,1],[0,1,0,2],[0,0,1,3],[0,0,0,1]]}, {"file_path": "b", "mask_path": "m.png", "w": 9, "h": 9,
"camera_angle_x": 0.7, "fl_x": null, "transform_matrix": [[1,0,0,1e6],[0,1,0,2],[0,0,1,3]]}]}
"""
XMP = """<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF
 xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#"><rdf:Description
 xcr:DistortionModel="brown4t2" xcr:FocalLength35mm="30" xcr:Skew="0.1" xcr:AspectRatio="1.1"
 xcr:PrincipalPointU="0.01" xcr:PrincipalPointV="-0.01"
 xmlns:xcr="http://www.capturingreality.com/ns/xcr/1.1#"><xcr:Rotation>1 0 0 0 1 0 0 0 1
</xcr:Rotation><xcr:Position>1 2 3</xcr:Position><xcr:DistortionCoeficients>.1 .2 .3 .4 .01 .02
</xcr:DistortionCoeficients></rdf:Description></rdf:RDF></x:xmpmeta>
"""
CSV = """#cameras 1
#name,x,y,alt,heading,pitch,roll,f,px,py,k1,k2,k3,k4,t1,t2
photo.png,1,2,3,10,20,30,35,0.01,-0.02,.1,.2,.3,.4,.01,.02
"""
BUNDLER = "# Bundle file v0.3\n2 1\n10 -.1 .2\n1 0 0\n0 1 0\n0 0 1\n1 2 3\n" + "0 0 0\n" * 5
BUNDLER += "1 2 3\n255 0 0\n1 0 5 1.5 2.5\n"
POINTS = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
POINTS += "property float z\nend_header\n1 2 3\n"
PLY = """comment TextureFile photo.png
comment TextureFile skin.<UDIM>.png
element camera 1
property list uchar float k
element vertex 4
property float x
property double y
property float z
property float nx
property float ny
property float nz
property uchar red
property uchar green
property uchar blue
property float s
property float t
element face 2
property list uchar int vertex_indices
property list uchar float texcoord
property char texnumber
end_header
"""


def paths(folder: Path) -> tuple[Path, Path | None]:
    """What to read of a folder that `make` has made, and the cameras that a mesh alone needs."""
    main = folder / MAIN[folder.name]
    return main, folder / "cameras.xml" if main.suffix == ".ply" else None


def make(folder: Path) -> None:
    """Writes them all below `folder`."""
    texts = {
        "metashape": {"cameras.xml": METASHAPE},
        "x3d": {"scene.x3d": X3D},
        "colmap_text": COLMAP,
        "nerf": {"transforms.json": NERF, "points.ply": POINTS},
        "xmp": {"photo.xmp": XMP},
        "csv": {"cameras.csv": CSV},
        "ply_text": {"scan.ply": _ply_text(), "cameras.xml": METASHAPE},
        "ply_binary": {"cameras.xml": METASHAPE},
        "bundler": {"bundle.out": BUNDLER, "list.txt": "photo.png 0 10.5\nb.png\n"},
    }
    for name, files in texts.items():
        (folder / name).mkdir()
        for file, content in files.items():
            (folder / name / file).write_text(content)
    (folder / "ply_binary" / "scan.ply").write_bytes(_ply_binary())
    for name in ("x3d", "nerf", "xmp", "csv", "bundler", "ply_text", "ply_binary"):
        _photo(folder / name / "photo.png")
    (folder / "compressed").mkdir()
    (folder / "compressed" / "scene.x3dz").write_bytes(gzip.compress(X3D.encode(), mtime=0))
    (folder / "colmap_binary").mkdir()
    for name, content in _colmap().items():
        (folder / "colmap_binary" / f"{name}.bin").write_bytes(content)


def _ply_text() -> str:
    vertex = "{0} 1 0 0 0 1 255 0 9 0.5 1\n"
    rows = ["1 0.5\n", *(vertex.format(n) for n in range(4))]
    rows += ["4 0 1 2 3 8 0 0 1 0 1 1 0 1 1\n", "3 0 1 2 0 -1\n"]
    return "ply\nformat ascii 1.0\n" + PLY + "".join(rows)


def _ply_binary() -> bytes:
    head = b"ply\nformat binary_big_endian 1.0\n" + PLY.encode()
    body = struct.pack(">Bf", 1, 0.5)
    for number in range(4):
        body += struct.pack(">fd4f3B2f", number, 1, 0, 0, 0, 1, 255, 0, 9, 0.5, 1)
    for _ in range(2):
        body += struct.pack(">B3iB6fb", 3, 0, 1, 2, 6, 0, 0, 1, 0, 1, 1, 1)
    return head + body


def _photo(path: Path) -> None:
    from PIL import Image

    Image.new("L", (12, 12), 90).save(path)


def _colmap() -> dict[str, bytes]:
    pose = struct.pack("<7d", 1, 0, 0, 0, 0, 0, 4)
    camera = struct.pack("<IiQQ8d", 1, 4, 12, 12, 10, 11, 6, 5, 0.1, 0.2, 0.01, 0.02)
    other = struct.pack("<IiQQ5d", 2, 7, 12, 12, 10, 10, 6, 6, 1)
    image = struct.pack("<I", 1) + pose + struct.pack("<I", 1) + b"a.png\0"
    image += struct.pack("<QddQ", 1, 1.5, 2.5, 7)
    last = struct.pack("<I", 2) + pose + struct.pack("<I", 2) + b"b.png\0" + struct.pack("<Q", 0)
    frame = struct.pack("<II", 1, 1) + pose
    frame += struct.pack("<IiIQiIQ", 2, 0, 1, 1, 0, 2, 2)
    return {
        "cameras": struct.pack("<Q", 2) + camera + other,
        "images": struct.pack("<Q", 2) + image + last,
        "points3D": struct.pack("<QQ3d3BdQII", 1, 7, 1, 2, 3, 255, 0, 9, 0.5, 1, 1, 0),
        "rigs": struct.pack("<QIIiIiI?", 1, 1, 2, 0, 1, 0, 2, True) + pose,
        "frames": struct.pack("<Q", 1) + frame,
    }
