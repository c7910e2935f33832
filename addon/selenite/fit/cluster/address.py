# SPDX-License-Identifier: GPL-3.0-or-later
"""The scheduler that a command names, and whether its connection may be used."""

from __future__ import annotations

import ipaddress
import re
from dataclasses import dataclass

from ...problems import BadInput, Problem

_TITLE = "Argument --scheduler"
_SHAPE = "give tcp://HOST:PORT, tls://HOST:PORT or local:N"
#: Processes of a local cluster at most.
MOST_LOCAL = 1024


@dataclass(frozen=True)
class Address:
    """url: of a scheduler that runs, "" for `local` processes of this machine."""

    url: str = ""
    local: int = 0

    def __str__(self) -> str:
        return self.url or f"local:{self.local}"


def address_of(text: str, *, unencrypted: bool = False) -> Address:
    """Reads what --scheduler says. unencrypted: a connection to another machine need not be
    encrypted. Raises BadInput."""
    if count := re.fullmatch(r"local:(\d{1,9})", text):
        number = int(count[1])
        if not 1 <= number <= MOST_LOCAL:
            cause = f"it asks for {number} local workers"
            raise BadInput(Problem(_TITLE, cause, f"give 1 to {MOST_LOCAL}"))
        return Address(local=number)
    found = re.fullmatch(r"(tcp|tls)://(\[[0-9a-fA-F:.]+\]|[^\s\[\]:/@]+):(\d{1,5})", text)
    if not found or not 1 <= int(found[3]) <= 65535:
        raise BadInput(Problem(_TITLE, f"'{text}' is no address of a scheduler", _SHAPE))
    if found[1] == "tcp" and not unencrypted and not _is_here(found[2].strip("[]")):
        cause = f"the connection to '{found[2]}' is not encrypted: who reads along can run programs"
        cure = (
            "use tls:// with the certificates of dask, or add --unencrypted in a network of yours"
        )
        raise BadInput(Problem(_TITLE, cause, cure))
    return Address(url=text)


def _is_here(host: str) -> bool:
    """Whether a host is this machine, by its name alone."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
