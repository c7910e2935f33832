# SPDX-License-Identifier: GPL-3.0-or-later
"""The pixels of Blender's images as Cycles sees them: encoding, association of alpha.

`Image.pixels` gives the stored values of byte images (straight alpha, not decoded) and the
scene-linear, associated values of float images: of files, packed and generated images alike.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, cast

import bpy
import numpy as np

from ...messages import thing
from ...problems import Problem
from .. import hosts
from . import file_alpha
from .file_alpha import FileAlpha
from .nodes import Unreadable

if TYPE_CHECKING:
    from ..hosts import BpyStruct


@dataclass(frozen=True, eq=False)
class Pixels:
    """An image, row 0 at the top: `color` (h, w, 3) float32, `alpha` (h, w) float32.

    `encoded`: the colours are sRGB code values, which Cycles interpolates before it decodes them.
    `associated`: Cycles counts the colours as multiplied by alpha (as they are, encoded or not).
    """

    color: np.ndarray
    alpha: np.ndarray
    encoded: bool
    associated: bool

    def decoded(self) -> np.ndarray:
        """(h, w, 3) scene-linear colours."""
        return decode(self.color) if self.encoded else self.color


def read_pixels(image: bpy.types.Image) -> Pixels:
    """Reads a file, a packed or a generated image. Raises Unreadable; changes nothing."""
    title = thing("Image", image.name)
    raw = _stored(image, title)
    if not np.isfinite(raw).all():
        raise Unreadable(title, "it contains NaN or infinite pixels", "repair the image")
    color = raw[..., :3] if image.channels >= 3 else np.repeat(raw[..., :1], 3, axis=2)
    with_alpha = image.channels in {2, 4} and image.alpha_mode != "NONE"
    alpha = raw[..., -1] if with_alpha else np.ones(raw.shape[:2], np.float32)
    # Packing channels and data mean that alpha is a channel of its own.
    associated = with_alpha and not (image.alpha_mode == "CHANNEL_PACKED" or hosts.is_data(image))
    file = _file_alpha(image, title)
    if hosts.is_version_3() and with_alpha and file is not None and file.channels == 2:
        cause = "Blender 3 and its Cycles read the alpha of a grey file differently"
        raise Unreadable(title, cause, "set its alpha mode to None, or save it as RGBA")
    if associated and file is not None and not (alpha == 1).all():
        _judge_alpha_mode(image, file, alpha, title)
    # Of one grey and one alpha channel Cycles multiplies neither.
    is_grey = associated and file is not None and file.channels == 2
    if not image.is_float:
        encoded = hosts.is_srgb(image)
        if not encoded and not hosts.is_linear(image):
            name = image.colorspace_settings.name
            cure = "set it to sRGB, Non-Color or Linear Rec.709, or save it as a float image"
            raise Unreadable(title, f"the colour space of this 8-bit image is '{name}'", cure)
        if associated and not is_grey and (file is None or not file.associated):
            # As in Cycles: in bytes, cut off.
            product = np.rint(color * 255) * np.rint(alpha * 255)[..., None]
            color = np.floor(product / 255) / np.float32(255)
    else:
        # Blender has decoded it. Cycles reads a file (not what is packed or generated) anew and
        # keeps its code values.
        encoded = file is not None and hosts.is_srgb(image)
        factor = np.where(associated & (alpha != 0), alpha, np.float32(1))[..., None]
        if encoded:
            color = _encode(color / factor) * factor
            if not np.isfinite(color).all():
                cause = (
                    "some of its pixels have no sRGB code value (its colours or alpha are extreme)"
                )
                raise Unreadable(
                    title, cause, "set its colour space to Linear, or repair the image"
                )
        if is_grey and image.alpha_mode == "STRAIGHT":  # by Blender then
            color = color / factor
    return Pixels(
        np.ascontiguousarray(color, np.float32),
        np.ascontiguousarray(alpha, np.float32),
        encoded,
        associated,
    )


def missing_in(tree: bpy.types.NodeTree) -> list[Problem]:
    """What is said of the images in a node tree and its groups whose files are gone: for nodes that
    nobody reads, as another one is refused."""
    found: list[Problem] = []
    trees, seen = [tree], {tree}
    while trees:
        for node in trees.pop().nodes:
            inner = getattr(node, "node_tree", None)
            if inner is not None and inner not in seen:
                seen.add(inner)
                trees.append(inner)
            image = getattr(node, "image", None)
            if image is None or image.source != "FILE" or image.packed_file:
                continue
            path = bpy.path.abspath(image.filepath, library=image.library)
            if any(output.is_linked for output in node.outputs) and not Path(path).is_file():
                problem = _gone(image, thing("Image", image.name)).problem
                found += [problem] if problem not in found else []
    return found


def _gone(image: bpy.types.Image, title: str) -> Unreadable:
    path = bpy.path.abspath(image.filepath, library=image.library)
    cause = f"its file '{path}' cannot be read, so that Cycles shows magenta"
    cure = "relink it (File > External Data > Find Missing Files) or choose another image"
    return Unreadable(title, cause, cure)


def is_stale(image: bpy.types.Image) -> bool:
    """Whether Cycles, which reads files anew, would not see what was painted."""
    return bool(image.is_dirty and image.source == "FILE" and not image.packed_file)


def _file_alpha(image: bpy.types.Image, title: str) -> FileAlpha | None:
    """Of the file that Cycles reads; None for what it gets from Blender, packed or generated."""
    if image.source != "FILE" or image.packed_file:
        return None
    path = bpy.path.abspath(image.filepath, library=image.library)
    try:
        return file_alpha.read(path)
    except OSError as error:
        cause = f"its file '{path}' cannot be read ({error.strerror}), and Cycles reads it anew"
        cure = "relink it (File > External Data > Find Missing Files), pack it or save it"
        raise Unreadable(title, cause, cure) from error


def _judge_alpha_mode(
    image: bpy.types.Image, file: FileAlpha, alpha: np.ndarray, title: str
) -> None:
    """Refuses what Blender reads and Cycles renders differently: Cycles goes by the file alone, and
    what Blender has multiplied or divided cannot always be undone."""
    if hosts.is_version_3() and image.is_float and file.associated and hosts.is_srgb(image):
        cause = "Blender 3 decodes this float file by its alpha, which cannot be undone"
        raise Unreadable(title, cause, "set its colour space to Linear, or pack the image")
    is_grey = image.is_float and file.channels == 2
    natural = "PREMUL" if file.associated and image.is_float else "STRAIGHT"
    if image.alpha_mode != natural and not is_grey:
        shown = "Straight" if natural == "STRAIGHT" else "Premultiplied"
        cause = f"Cycles takes the alpha of this file as {shown}, whatever its alpha mode says"
        raise Unreadable(title, cause, f"set its alpha mode to {shown}, or pack the image")
    if is_grey and image.alpha_mode == "STRAIGHT" and (alpha == 0).any():
        cause = "Blender keeps no grey of this file where its alpha is 0, but Cycles shows it"
        raise Unreadable(title, cause, "set its alpha mode to None or Channel Packed")


def _stored(image: bpy.types.Image, title: str) -> np.ndarray:
    """(h, w, channels) float32, row 0 at the top."""
    if image.source not in {"FILE", "GENERATED"}:
        cause = f"its source is {image.source.lower()}"
        raise Unreadable(title, cause, "use a single image")
    width, height = image.size
    stored = cast(
        "BpyStruct", image.pixels
    )  # the stubs say one float; it is an array of all channels
    if width == 0 or height == 0 or len(stored) == 0:
        raise _gone(image, title)
    pixels = np.empty(len(stored), np.float32)
    stored.foreach_get(pixels)
    return pixels.reshape(height, width, image.channels)[::-1]


def decode(encoded: np.ndarray) -> np.ndarray:
    """sRGB code values to linear light."""
    low = encoded / 12.92
    high = ((np.maximum(encoded, 0.04045) + 0.055) / 1.055) ** 2.4
    return np.where(encoded <= 0.04045, low, high).astype(np.float32)


def _encode(linear: np.ndarray) -> np.ndarray:
    """Linear light to sRGB code values."""
    low = linear * 12.92
    high = 1.055 * np.maximum(linear, 0.0031308).astype(np.float64) ** (1 / 2.4) - 0.055
    return np.where(linear <= 0.0031308, low, high).astype(np.float32)
