# SPDX-License-Identifier: GPL-3.0-or-later
"""Texts of the panel: translated, and in lines that fit the region."""

from __future__ import annotations

import json
import re
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import blf
import bpy

from ..messages import Message, rendered
from .controls import CONTROLS

if TYPE_CHECKING:
    from ..scene_read.hosts import BpyStruct

MESSAGES = Path(__file__).parent / "furniture" / "messages"

#: Width of a letter in pixels at a scale of the interface of 1, on average, and what a panel keeps
#: for itself at both sides.
_LETTER, _MARGIN = 6.6, 46
_UNKNOWN = 258.0  # of a region without a width
_FEWEST = 18
#: Id of a message that names a loss, without its name -> see TITLES.
_CONTROL, _LOSS = "control.", "control.loss."
#: What the command line calls a loss -> what the panel calls it, see properties.
TITLES: dict[str, str] = {}
#: Letters of a line in a pop-up, see result.panel.
_POP_UP = 62
_LABEL = 0.45  # of the width
_STEM = 3  # letters of an abbreviation
#: Pixels of a point, as Blender draws a label: a word of 65 pixels at 11 points has 71 there.
_POINT = 1.09


def translated(text: str) -> str:
    """In the language of the interface."""
    return str(bpy.app.translations.pgettext_iface(text))


def shown(text: str) -> str:
    """A text of the panel, or a message, in the language of the interface and in the words of the
    panel."""
    return rendered(text, _template) if isinstance(text, Message) else translated(text)


def _template(key: str) -> str | None:
    """What the panel says for the message `key`; None: its English."""
    if key.startswith(_LOSS):
        return translated(TITLES[key.removeprefix(_LOSS)])
    if key.startswith(_CONTROL):
        return translated(CONTROLS[key.removeprefix(_CONTROL)])
    if not bpy.context.preferences.view.use_translate_interface:
        return None
    return _messages(bpy.app.translations.locale).get(key)


def announce(operator: bpy.types.Operator, kinds: set[str], text: str) -> None:
    """As `operator.report`, in the language of the interface."""
    operator.report(kinds, shown(text))  # type: ignore[arg-type]  # a set of words


@lru_cache(maxsize=4)
def _messages(locale: str) -> dict[str, str]:
    """Id -> text. Blender 4 and later call German "de"."""
    language = locale.partition("_")[0]
    for path in sorted(MESSAGES.glob("*.json")):
        if path.stem == locale or (language == locale and path.stem.partition("_")[0] == locale):
            found: dict[str, str] = json.loads(path.read_text(encoding="utf-8"))
            return found
    return {}


def region_width(context: bpy.types.Context) -> float:
    """In pixels, at a scale of the interface of 1."""
    region = getattr(context, "region", None)
    if region is None or region.width <= 1:
        return _UNKNOWN
    return region.width / (context.preferences.system.ui_scale or 1.0)  # 0 without a window


def letters(context: bpy.types.Context, less: int = 0) -> int:
    """How many letters a line of the region holds. less: pixels that are taken, as by an icon."""
    region = getattr(context, "region", None)
    if region is not None and region.type != "UI" and context.area.type == "VIEW_3D":
        return _POP_UP  # drawn over the view
    return max(_FEWEST, int((region_width(context) - _MARGIN - less) / _LETTER))


def wrapped(text: str, width: int) -> list[str]:
    """A sentence in lines of at most `width` letters; a longer word has a line of its own, or two
    with its hyphen between them. A number keeps its per cent."""
    lines = [""]
    for word in re.split(r"\s+(?!%)", text.strip()):
        parts = re.split(r"(?<=-)", word) if len(word) > width else [word]
        for index, part in enumerate(parts):
            between = " " if lines[-1] and index == 0 else ""
            if lines[-1] and len(lines[-1] + between + part) > width:
                lines.append("")
                between = ""
            lines[-1] += between + part
    return lines


def abbreviated(text: str, width: float) -> str:
    """A name in `width` pixels if that can be: "Transm. Roughness". The last word, which sets it
    from others, stays whole."""
    *words, last = text.split() or [""]
    for index, word in enumerate(words):
        for end in range(len(word) - 2, _STEM - 1, -1):
            if text_width(" ".join([*words, last])) <= width:
                break
            words[index] = f"{word[:end].rstrip('aeiouäöü')}."
    return " ".join([*words, last])


def text_width(text: str) -> float:
    """In pixels, at a scale of the interface of 1."""
    return _width(text, bpy.context.preferences.ui_styles[0].widget.points)


@lru_cache(maxsize=512)
def _width(text: str, points: float) -> float:
    blf.size(0, points * _POINT)
    return float(blf.dimensions(0, text)[0])


def field(layout: bpy.types.UILayout, data: BpyStruct, name: str) -> None:
    """A property so that the sidebar at its usual width cuts no label: switches and numbers have
    theirs inside, others have it to the left."""
    kind = data.bl_rna.properties[name]
    if kind.type in {"ENUM", "STRING", "POINTER"} or getattr(kind, "subtype", "") == "COLOR":
        parts = layout.split(factor=_LABEL, align=True)
        parts.label(text=kind.name)
        parts.prop(data, name, text="")
    else:
        layout.prop(data, name)


def paragraph(
    layout: bpy.types.UILayout,
    context: bpy.types.Context,
    text: str,
    icon: str = "NONE",
    lines: int = 1,
) -> None:
    """A sentence in lines close together, at least so many of them, as wide as the region, in the
    interface's language."""
    text = shown(text)
    column = layout.column(align=True)
    has_icon = icon != "NONE"
    found = wrapped(text, letters(context, 24 if has_icon else 0))
    for index, line in enumerate([*found, *[""] * (lines - len(found))]):
        symbol = icon if index == 0 else ("BLANK1" if has_icon else "NONE")
        column.label(text=line, icon=symbol, translate=False)
