# SPDX-License-Identifier: GPL-3.0-or-later
"""Warnings of the reader, drawn with what they are about until a later read finds them mended."""

from __future__ import annotations

from collections.abc import Collection

import bpy

from ..capture.scene_captures import ids_of, photo_name
from ..messages import subject
from ..scene_read.camera import named_cameras
from .state import WARNINGS
from .texts import paragraph

#: As `messages.subject` has it.
Subject = tuple[str, str]


def of_capture(scene: bpy.types.Scene, index: int) -> set[Subject]:
    """What a warning about a row of the captures may be about: its camera, photo or mask."""
    row = scene.selenite.captures[index]
    names = {item: name for name, item in named_cameras(scene).items()}
    found = {("photo", ids_of(scene)[index]), ("mask", bpy.path.abspath(row.mask_path))}
    if row.camera is not None:
        found.add(("camera", names.get(row.camera, row.camera.name)))
    if row.photo is not None:
        found.add(("photo", photo_name(row.photo)))
    return found


def of_owner(scene: bpy.types.Scene, owner: bpy.types.PropertyGroup) -> set[Subject]:
    """The same of a material, light or world."""
    is_world = owner.kind == "world" and scene.world is not None
    return {(owner.kind, scene.world.name if is_world else owner.name)}


def about(scene: bpy.types.Scene, subjects: Collection[Subject]) -> list[str]:
    """The warnings about any of these."""
    return [text for text in _all(scene) if subject(text) in subjects]


def others(scene: bpy.types.Scene) -> list[str]:
    """The warnings that no row of captures or owners has."""
    settings = scene.selenite
    shown = {one for item in settings.owners for one in of_owner(scene, item)}
    for index in range(len(settings.captures)):
        shown |= of_capture(scene, index)
    return [text for text in _all(scene) if subject(text) not in shown]


def draw(layout: bpy.types.UILayout, context: bpy.types.Context, warnings: Collection[str]) -> None:
    """A row for each, with its sentence."""
    for text in warnings:
        paragraph(layout.box(), context, text, "ERROR")


def _all(scene: bpy.types.Scene) -> list[str]:
    known = WARNINGS.get(scene.name)
    return [] if known is None else [*known.of_scene, *known.of_plan]
