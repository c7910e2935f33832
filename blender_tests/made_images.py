# SPDX-License-Identifier: GPL-3.0-or-later
"""Small images by script: made in Blender, packed or in files, of every depth."""

import struct
import zlib

import bpy
import numpy as np

SIZE = (5, 3)  # odd, so that centres and edges of texels are told apart


def decoded(values):
    """Linear numbers of sRGB ones in [0, 1]: IEC 61966-2-1, written down here."""
    x = np.asarray(values, np.float64)
    return np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4).astype(np.float32)


def encoded(values):
    """The inverse."""
    x = np.asarray(values, np.float64)
    curve = 1.055 * np.maximum(x, 0.0031308) ** (1 / 2.4) - 0.055
    return np.where(x <= 0.0031308, 12.92 * x, curve).astype(np.float32)


def texels(alpha=True):
    """(h, w, 4) uint8, row 0 at the top."""
    values = np.random.default_rng(1).integers(0, 256, (SIZE[1], SIZE[0], 4), dtype=np.uint8)
    values[0, :2, 3] = (0, 255)
    if not alpha:
        values[..., 3] = 255
    return values


def write_png(path, values, transparent=None):
    """8 or 16 bits, straight alpha. values: (h, w, 4) RGBA, (h, w, 3) RGB, (h, w, 2) grey and
    alpha, or (h, w, 1) grey; transparent: the value of a grey that counts as transparent."""
    height, width, channels = values.shape
    depth = 8 * values.dtype.itemsize
    rows = values.astype(values.dtype.newbyteorder(">")).reshape(height, -1)
    data = b"".join(b"\0" + row.tobytes() for row in rows)

    def chunk(kind, body):
        check = struct.pack(">I", zlib.crc32(kind + body))
        return struct.pack(">I", len(body)) + kind + body + check

    kind = {1: 0, 2: 4, 3: 2, 4: 6}[channels]
    header = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, depth, kind, 0, 0, 0))
    if transparent is not None:
        header += chunk(b"tRNS", struct.pack(">H", transparent))
    parts = header + chunk(b"IDAT", zlib.compress(data)) + chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + parts)
    return path


def write_tiff(path, values, extra):
    """8 or 16 bits without compression. values: (h, w, 2 or 4), alpha last; extra: what the file
    says of it, 0 nothing, 1 that the colours were multiplied by it, 2 that they were not."""
    height, width, channels = values.shape
    data = values.astype(values.dtype.newbyteorder("<")).tobytes()
    bits = struct.pack(f"<{channels}H", *[8 * values.dtype.itemsize] * channels)
    long_bits = channels > 2  # more than the four bytes of an entry
    start = 8 + len(data)
    rows = [
        (256, 4, 1, width),
        (257, 4, 1, height),
        (258, 3, channels, start if long_bits else int.from_bytes(bits, "little")),
        (259, 3, 1, 1),
        (262, 3, 1, 2 if channels == 4 else 1),
        (273, 4, 1, 8),
        (277, 3, 1, channels),
        (278, 4, 1, height),
        (279, 4, 1, len(data)),
        (284, 3, 1, 1),
        (338, 3, 1, extra),
    ]
    outside = bits if long_bits else b""
    directory = struct.pack("<H", len(rows)) + b"".join(struct.pack("<HHII", *row) for row in rows)
    head = struct.pack("<2sHI", b"II", 42, start + len(outside))
    path.write_bytes(head + data + outside + directory + bytes(4))
    return path


def write_tga(path, values, kind=None):
    """8 bits RGBA; kind: what the extension area says of alpha (3 straight, 4 multiplied), None: it
    has none."""
    height, width = values.shape[:2]
    head = struct.pack("<BBBHHBHHHHBB", 0, 0, 2, 0, 0, 0, 0, 0, width, height, 32, 0x28)
    body = head + values[..., [2, 1, 0, 3]].tobytes()
    if kind is not None:
        area = struct.pack("<H", 495) + bytes(492) + bytes([kind])
        footer = struct.pack("<II", len(body), 0) + b"TRUEVISION-XFILE.\0"
        body += area + footer
    path.write_bytes(body)
    return path


def linear_name():
    """What this Blender calls linear Rec. 709."""
    return "Linear" if bpy.app.version < (4, 0, 0) else "Linear Rec.709"


def image(folder, kind="generated8", space="sRGB", mode="STRAIGHT", alpha=True):
    """An image: made in Blender, packed or in a file; of bytes, 16 bits or floats."""
    values = texels(alpha)
    where, depth = kind.rstrip("0123456789"), kind.lstrip("abcdefghijklmnopqrstuvwxyz")
    if where == "generated":
        found = bpy.data.images.new("made", *SIZE, alpha=True, float_buffer=depth == "32")
        found.colorspace_settings.name = linear_name() if space == "Linear" else space
        found.alpha_mode = mode
        numbers = values[::-1].astype(np.float32) / 255
        if depth == "32":
            numbers[..., :3] *= 1.5
        found.pixels.foreach_set(numbers.ravel())
        found.update()
        return found
    path = folder / f"{kind}_{space}_{mode}_{alpha}.png"
    if depth == "32":
        from selenite import native

        path = path.with_suffix(".exr")
        numbers = values / np.array([200, 200, 200, 255], np.float32)
        names = ["R", "G", "B", "A"] if alpha else ["R", "G", "B"]
        native.image().write_exr(str(path), numbers[..., : len(names)], channel_names=names)
    elif depth == "16":
        write_png(path, values.astype(np.uint16) * 257 // np.uint16(2) + np.uint16(77))
    else:
        write_png(path, values)
    found = bpy.data.images.load(str(path))
    found.colorspace_settings.name = linear_name() if space == "Linear" else space
    found.alpha_mode = mode
    if where == "packed":
        found.pack()
        path.unlink()
    return found
