# SPDX-License-Identifier: GPL-3.0-or-later
"""Messages of the add-on in another language. No Blender here.

Messages are made elsewhere, in English, with names and numbers in them. A language has a pattern
for each, with "{}" for what is filled in; what fills it is translated in turn. A name, which
stands between quotes, is not: a camera may be called 'left'.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import lru_cache

_DEEPEST = 3  # a message in a message in a message
_TITLE_ENDS = ": "  # what a message is about
#: Where a message that has no pattern is cut into parts that may have one.
_CUTS = ("\n", ". ", "; ", _TITLE_ENDS, ", ")


class Messages:
    """One language: pattern -> its text, with as many "{}" in the same order."""

    def __init__(self, texts: Mapping[str, str]) -> None:
        self._whole = {text: words for text, words in texts.items() if "{}" not in text}
        open_ones = [(text.split("{}"), words) for text, words in texts.items() if "{}" in text]
        # Of two that match, the one that says more is meant.
        self._open = sorted(open_ones, key=lambda item: -sum(map(len, item[0])))
        self.translated = lru_cache(maxsize=4096)(self._translated)

    def _translated(self, text: str, depth: int = 0) -> str:
        """`text` itself where this language has nothing of it."""
        if text in self._whole:
            return self._whole[text]
        if depth > _DEEPEST or not text:
            return text
        for parts, words in self._open:
            found = _filling(parts, text)
            if found is not None:
                return words.format(
                    *(
                        item if _is_name(parts, at) else self.translated(item, depth + 1)
                        for at, item in enumerate(found)
                    )
                )
        for cut in _CUTS:
            first, found_cut, rest = text.partition(cut)
            if found_cut:
                return self.translated(first, depth) + cut + self.translated(rest, depth)
        return text


def _filling(parts: list[str], text: str) -> list[str] | None:
    """What stands for each "{}" between the parts, each as short as can be; None if it is another
    message."""
    first, last = parts[0], parts[-1]
    if not (text.startswith(first) and text.endswith(last)):
        return None
    if len(text) < len(first) + len(last) or not all(part in text for part in parts):
        return None
    found = re.fullmatch("(.+?)".join(map(re.escape, parts)), text, re.DOTALL)
    if found is None or (not first and _TITLE_ENDS in found[1]):
        return None  # what a message is about is no part of its first word
    return list(found.groups())


def _is_name(parts: list[str], at: int) -> bool:
    return parts[at].endswith("'") and parts[at + 1].startswith("'")
