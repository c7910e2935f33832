# SPDX-License-Identifier: GPL-3.0-or-later
"""Sentences that the panel shows daily: English beside an id, other languages by that id.

A message is the English text, so that files, reports and the command line take it as it is. It
keeps what it is made of: the panel puts it into another language, or into its own words, without
looking at the text. What fills a message may be one itself.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping


class Message(str):
    """English with its arguments filled in. key: "" for what has no text in another language, but
    arguments that have one."""

    __slots__ = ("arguments", "english", "key")
    key: str
    english: str
    arguments: Mapping[str, object]

    def __new__(cls, key: str, english: str, arguments: Mapping[str, object]) -> Message:
        """english: with "{name}" for each argument."""
        self = super().__new__(cls, english.format_map(arguments))
        self.key, self.english, self.arguments = key, english, arguments
        return self

    def __reduce__(self) -> tuple[type[Message], tuple[str, str, Mapping[str, object]]]:
        """For copies and other processes."""
        return Message, (self.key, self.english, self.arguments)


def message(key: str, english: str, /, **arguments: object) -> str:
    """The sentence `key`. english: with "{name}" for each argument."""
    return Message(key, english, arguments)


def thing(kind: str, name: object) -> str:
    """What a problem is about, as "Camera 'Front'"; kind: in English, with a capital."""
    return Message(f"thing.{kind.lower()}", f"{kind} '{{name}}'", {"name": name})


def named(text: str) -> tuple[str, str]:
    """(kind in small letters, name) of what `thing` has made; ("", "") of another text."""
    if not isinstance(text, Message) or not text.key.startswith("thing."):
        return "", ""
    return text.key.removeprefix("thing."), str(text.arguments["name"])


def remark(about: str, text: str, separator: str = ": ") -> str:
    """A warning about a thing, which the panel shows with it."""
    return phrase("{about}{separator}{text}", about=about, separator=separator, text=text)


def subject(text: str) -> tuple[str, str]:
    """(kind in small letters, name) of what a remark is about, or of a thing itself; ("", "") of
    another text."""
    about = text.arguments.get("about") if isinstance(text, Message) else None
    return subject(about) if isinstance(about, str) else named(text)


def control(name: str, option: str) -> str:
    """What the user is to use: an option of the command line, or the panel's control `name`."""
    return Message(f"control.{name}", option.replace("{", "{{").replace("}", "}}"), {})


def phrase(english: str, /, **arguments: object) -> str:
    """A text that is not put into other languages, around messages that are."""
    return Message("", english, arguments)


def joined(separator: str, parts: Iterable[str]) -> str:
    """As `separator.join`, with messages among the parts; the separator may be one too."""
    found = {f"part{at}": part for at, part in enumerate(parts)}
    english = "{separator}".join(f"{{{name}}}" for name in found)
    return Message("", english, found | {"separator": separator})


def rendered(text: object, template_of: Callable[[str], str | None]) -> str:
    """`text` in the words that `template_of` has for a key; English where it has none."""
    if not isinstance(text, Message):
        return str(text)
    template = (template_of(text.key) if text.key else None) or text.english
    return template.format_map(
        {name: rendered(part, template_of) for name, part in text.arguments.items()}
    )


def packed(texts: Iterable[str]) -> str:
    """Messages for a property of Blender, which keeps plain text only."""
    return json.dumps([_plain(text) for text in texts])


def unpacked(text: str) -> list[str]:
    """What `packed` was given; the text itself where an earlier version has written it."""
    try:
        found = json.loads(text)
        return [_text(item) for item in found]
    except (ValueError, TypeError, AttributeError, LookupError):
        return text.splitlines()


def _plain(text: object) -> object:
    if not isinstance(text, Message):
        return str(text)
    arguments = {name: _plain(part) for name, part in text.arguments.items()}
    return [text.key, text.english, arguments]


def _text(item: object) -> str:
    if not isinstance(item, list):
        return str(item)
    key, english, arguments = item
    return Message(key, english, {name: _text(part) for name, part in arguments.items()})
