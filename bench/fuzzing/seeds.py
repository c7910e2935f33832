# SPDX-License-Identifier: GPL-3.0-or-later
"""Small valid files of each kind, made on the spot."""

from __future__ import annotations

import io
import json
import struct
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np

from . import reconstruction_seeds

KINDS = ("photos", "masks", "textures", "grids", "checkpoints", "reconstructions")
SIZE = 12


def make(kind: str, folder: Path) -> None:
    """Writes them into `folder`; a checkpoint is a folder of files, and so is
    each reconstruction."""
    makers: dict[str, Callable[[Path], None]] = {
        "photos": _photos,
        "masks": _masks,
        "textures": _photos,
        "grids": _grids,
        "checkpoints": _checkpoints,
        "reconstructions": reconstruction_seeds.make,
    }
    makers[kind](folder)


def _gradient(channels: int) -> np.ndarray:
    y, x = np.mgrid[0:SIZE, 0:SIZE] / SIZE
    planes = [0.1 + 0.7 * x, 0.2 + 0.5 * y, 0.3 + 0.3 * x * y, 0.5 + 0.5 * y]
    return np.stack(planes[:channels], axis=-1).astype(np.float32)


def _photos(folder: Path) -> None:
    import OpenEXR
    from PIL import Image, ImageCms

    eight = np.rint(_gradient(3) * 255).astype(np.uint8)
    rgba = np.rint(_gradient(4) * 255).astype(np.uint8)
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    exif = Image.Exif()
    exif[0x0112] = 1
    exif[0x8769] = {0xA001: 65535, 0xA005: {1: "R03"}}
    picture, alpha = Image.fromarray(eight), Image.fromarray(rgba)
    picture.save(folder / "rgb.png")
    alpha.save(folder / "rgba.png", icc_profile=profile)
    Image.fromarray(eight[..., 0]).save(folder / "grey.png")
    picture.save(folder / "plain.jpg", quality=90, exif=exif, icc_profile=profile)
    picture.save(folder / "progressive.jpg", quality=80, progressive=True)
    picture.convert("CMYK").save(folder / "cmyk.jpg")
    for name in ("raw", "tiff_lzw", "tiff_adobe_deflate", "packbits"):
        picture.save(folder / f"{name}.tif", compression=name, icc_profile=profile)
    alpha.save(folder / "rgba.tif")
    Image.fromarray(_gradient(1)[..., 0]).save(folder / "float.tif")
    picture.save(folder / "pages.tif", save_all=True, append_images=[picture.resize((4, 4))])
    (folder / "sixteen.png").write_bytes(_png16())
    for name, compression in (
        ("none", OpenEXR.NO_COMPRESSION), ("zip", OpenEXR.ZIP_COMPRESSION),
        ("rle", OpenEXR.RLE_COMPRESSION), ("piz", OpenEXR.PIZ_COMPRESSION),
        ("pxr24", OpenEXR.PXR24_COMPRESSION), ("dwaa", OpenEXR.DWAA_COMPRESSION),
        ("b44", OpenEXR.B44_COMPRESSION),
    ):  # fmt: skip
        header = {"compression": compression, "type": OpenEXR.scanlineimage}
        pixels = _gradient(4) if name != "b44" else _gradient(4).astype(np.float16)
        OpenEXR.File(header, {"RGBA": pixels}).write(str(folder / f"{name}.exr"))
    header = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        "chromaticities": (0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.32168, 0.33767),
    }
    OpenEXR.File(header, {"RGB": _gradient(3)}).write(str(folder / "ap1.exr"))
    parts = [
        OpenEXR.Part(header | {"name": "z"}, {"Z": _gradient(1)[..., 0].copy()}),
        OpenEXR.Part(header | {"name": "rgb"}, {"RGB": _gradient(3)}),
    ]
    OpenEXR.File(parts).write(str(folder / "parts.exr"))
    for fmt in ("rgbe", "xyze"):
        pixels = np.dstack([np.rint(_gradient(3) * 200), np.full((SIZE, SIZE), 128)])
        text = f"#?RADIANCE\nFORMAT=32-bit_rle_{fmt}\nEXPOSURE=2\n\n-Y {SIZE} +X {SIZE}\n"
        body = b"".join(_packed(row) for row in pixels.astype(np.uint8))
        (folder / f"{fmt}.hdr").write_bytes(text.encode() + body)


def _packed(row: np.ndarray) -> bytes:
    """A scanline of Radiance in runs of literal bytes, channel by channel."""
    count = len(row)
    body = b"".join(bytes([count]) + row[:, c].tobytes() for c in range(4))
    return bytes([2, 2, count >> 8, count & 255]) + body


def _png16() -> bytes:
    def chunk(name: bytes, data: bytes) -> bytes:
        return (
            struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
        )

    rows = np.rint(_gradient(3) * 65535).astype(">u2")
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", struct.pack(">IIBBBBB", SIZE, SIZE, 16, 2, 0, 0, 0))
        + chunk(b"gAMA", struct.pack(">I", 100000))
        + chunk(b"cHRM", struct.pack(">8I", 31270, 32900, 64000, 33000, 21000, 71000, 15000, 6000))
        + chunk(b"cICP", bytes([9, 8, 0, 1]))
        + chunk(b"IDAT", zlib.compress(b"".join(b"\0" + row.tobytes() for row in rows)))
        + chunk(b"IEND", b"")
    )


def _masks(folder: Path) -> None:
    import OpenEXR
    from PIL import Image

    grey = np.rint(_gradient(1)[..., 0] * 255).astype(np.uint8)
    Image.fromarray(grey).save(folder / "mask.png")
    Image.fromarray(grey).save(folder / "mask.tif")
    Image.fromarray(grey).save(folder / "mask.jpg")
    Image.fromarray(np.rint(_gradient(4) * 255).astype(np.uint8)).save(folder / "rgba.png")
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"Y": _gradient(1)[..., 0].copy()}).write(str(folder / "mask.exr"))


def _grids(folder: Path) -> None:
    from selenite import grid_files

    values = np.random.default_rng(1).random((3, 4, 5, 3), np.float32)
    grid_files.write_npy(folder / "colour.npy", values)
    grid_files.write_npy(folder / "number.npy", values[..., :1])
    np.save(folder / "fortran.npy", np.asfortranarray(values[..., 0].astype(float)))
    grid_files.write_vol(folder / "colour.vol", values, np.zeros(3), np.ones(3))
    packed = io.BytesIO()
    np.savez(packed, values)
    (folder / "zip.npy").write_bytes(packed.getvalue())


def _checkpoints(folder: Path) -> None:
    from selenite.fit import checkpoint
    from selenite.fit.request import RunRequest
    from selenite.fit.settings import FitSettings

    whole = folder / "run"
    whole.mkdir()
    request = RunRequest(scene="scene.blend", unknowns=(), captures=(), settings=FitSettings())
    (whole / "run.json").write_text(json.dumps(request.as_json()))
    (whole / "fit_1.state").write_bytes(bytes(range(256)) * 4)
    state = {"schema": checkpoint.SCHEMA, "file": "fit_1.state", "iterations": 2, "seconds": 1.0}
    (whole / "state.json").write_text(json.dumps(state))
