# SPDX-License-Identifier: GPL-3.0-or-later
"""What a property of a capture is declared by."""

from __future__ import annotations

from dataclasses import MISSING, dataclass, field, fields, replace
from typing import TypeVar, cast

from ..messages import thing
from .panel_controls import Binding, Control
from .value_kinds import Kind

#: In place of the default of what every capture has.
REQUIRED = object()
_DECLARED = "declared"  # in the metadata of a field
_Value = TypeVar("_Value")


@dataclass(frozen=True)
class Option:
    """How the command line spells a property. name: "" for that of the property. metavar: of its
    value. of_photo: it is given for one photo; otherwise for all that do not say. value: what the
    option sets where it takes none. help: "" for that of the property. more: what follows it."""

    name: str = ""
    metavar: str | None = None
    of_photo: bool = False
    value: bool | None = None
    help: str = ""
    more: str = ""


@dataclass(frozen=True)
class CaptureProperty:
    """kind: of its values. help: one sentence, without its full stop: tooltip, help of the option,
    and the guide. more: what the guide says beside it, in Markdown. left_out: what the default
    means. option: None: the command line has none. panel: None: a row does not hold it. native: the
    keyword of core.Photo, "" where a fit does not know of it."""

    kind: Kind
    help: str
    left_out: str = ""
    more: str = ""
    option: Option | None = None
    panel: Binding | None = None
    native: str = ""
    name: str = ""  # of its field, as is the default
    default: object = REQUIRED

    @property
    def argument(self) -> str:
        """Of the command line, "" where it has none."""
        return (self.option.name or self.name) if self.option is not None else ""

    @property
    def flag(self) -> str:
        """As it is given."""
        return f"--{self.argument.replace('_', '-')}"

    @property
    def is_required(self) -> bool:
        """Whether every capture has it."""
        return self.default is REQUIRED

    def titled(self, file: str) -> str:
        """What a file of it is called in messages."""
        return thing(self.name.capitalize(), file)

    def controls(self) -> tuple[Control, ...]:
        """Of the panel, with their help and the range of the value."""
        controls = self.panel.controls if self.panel is not None else ()
        return tuple(
            replace(
                control,
                help=control.help or self.help,
                keywords={
                    **(self.kind.limits() if control.kind in ("Int", "Float") else {}),
                    **control.keywords,
                },
            )
            for control in controls
        )


def declared(
    default: _Value,
    kind: Kind,
    help: str,  # noqa: A002 - as argparse and the table of parameters call it
    *,
    left_out: str,
    more: str = "",
    option: Option | None = None,
    panel: Binding | None = None,
    native: str = "",
) -> _Value:
    """A field of a dataclass with its default."""
    said = CaptureProperty(kind, help, left_out, more, option, panel, native)
    return field(default=default, metadata={_DECLARED: said})


def required(kind: Kind, help: str, more: str = "") -> str:  # noqa: A002 - see `declared`
    """A field that every capture has."""
    return cast(str, field(metadata={_DECLARED: CaptureProperty(kind, help, more=more)}))


def properties_of(request: type) -> tuple[CaptureProperty, ...]:
    """In their order."""
    return tuple(
        replace(
            item.metadata[_DECLARED],
            name=item.name,
            default=REQUIRED if item.default is MISSING else item.default,
        )
        for item in fields(request)
    )
