# SPDX-License-Identifier: GPL-3.0-or-later
"""What a row of the panel says of its photo, as fields of a CaptureRequest."""

from __future__ import annotations

import bpy

from ..scene_read.lens import LensDistortion
from .request import GAMMA


def photo_fields(photo: bpy.types.PropertyGroup) -> dict[str, object]:
    """Of the row's `how`, see interface.captures.photo; what is switched off is left out."""
    found: dict[str, object] = {
        "exclude": bpy.path.abspath(photo.exclude_path),
        "background": _background(photo),
        "response": _response(photo),
        "gain": "" if photo.gain == "NONE" else photo.gain.lower(),
        "align": True if photo.align else None,
        "hold_out": photo.hold_out,
    }
    if photo.use_silhouette:
        found["silhouette"] = photo.silhouette
    if photo.use_clip:
        found["clip"] = tuple(photo.clip)
    if photo.use_size:
        found["size"] = tuple(photo.size)
        found["crop"] = tuple(photo.crop) if photo.use_crop else None
    if photo.use_pixel_aspect:
        found["pixel_aspect"] = photo.pixel_aspect
    if photo.use_distortion:
        names = LensDistortion.__dataclass_fields__
        found["distortion"] = LensDistortion(**{name: getattr(photo, name) for name in names})
    elif photo.undistorted:
        found["distortion"] = False
    return found


def _background(photo: bpy.types.PropertyGroup) -> str:
    """As it is written in a file of captures."""
    if photo.background == "NONE":
        return ""
    color = ",".join(f"{value:.6g}" for value in photo.background_color)
    return f"{'border' if photo.background == 'BORDER' else color}:{photo.tolerance:.6g}"


def _response(photo: bpy.types.PropertyGroup) -> str:
    if photo.response == "GAMMA":
        return f"{GAMMA}{photo.gamma:.6g}"
    if photo.response == "TABLE":
        return bpy.path.abspath(photo.response_path) or "no table is chosen"
    return str(photo.response.lower())
