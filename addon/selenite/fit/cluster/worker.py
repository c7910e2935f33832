# SPDX-License-Identifier: GPL-3.0-or-later
"""What runs in the workers of a cluster."""

from __future__ import annotations

import hashlib
import os
import threading
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ... import __version__, native
from .opened import opened

if TYPE_CHECKING:
    from ..._core import StageWorker

#: Of the newest fits, by the digests of their parcels: who answers, and the proof.
_OPEN: dict[str, tuple[StageWorker, str]] = {}
_MOST_OPEN = 2
_LOCK = threading.Lock()


@dataclass(frozen=True)
class Share:
    """What a worker renders with. digest: of the fit's parcel. processes: workers on its machine.
    threads: of a render; 0: its share of the machine's cores."""

    digest: str
    processes: int = 1
    threads: int = 0

    def of_render(self) -> int:
        """Threads of a render in this process, which may render several photos at once."""
        from distributed import get_worker

        at_once = max(1, get_worker().state.nthreads) * self.processes
        return self.threads or max(1, (os.cpu_count() or 1) // at_once)


def about(data: bytes, share: Share) -> dict[str, object]:
    """What the fit compares with its own before the first question. data: its parcel, which is
    opened once."""
    return {**facts_here(), "proof": _opened(data, share)[1]}


def facts_here() -> dict[str, object]:
    """By which two processes know whether they compute the same numbers."""
    return {"version": __version__, "lanes": native.core().has_lanes()}


def answer(share: Share, question: bytes) -> bytes | None:
    """The picture that a fit asks for; None where this worker does not know the fit. The parcel is
    no argument: it may lie with a worker that hangs."""
    found = _OPEN.get(share.digest)
    return None if found is None else found[0].answer(question)


def _opened(data: bytes, share: Share) -> tuple[StageWorker, str]:
    with _LOCK:
        found = _OPEN.get(share.digest)
        if found is None:
            if hashlib.sha256(data).hexdigest() != share.digest:
                raise ValueError("the scene that this worker was sent is damaged")
            found = opened(data, share.of_render())
            while len(_OPEN) >= _MOST_OPEN:
                del _OPEN[next(iter(_OPEN))]
            _OPEN[share.digest] = found
        return found
