# SPDX-License-Identifier: GPL-3.0-or-later
"""Photos side by side: the native reader leaves Python's lock alone while it decodes."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import TypeVar

Result = TypeVar("Result")

#: Photos at once, and their pixels: a decoder holds all of a photo, with 16 bits some 6 bytes a
#: pixel.
_MOST, _MOST_PIXELS = 8, 200_000_000
#: Seconds between two looks at whether to go on.
_TICK = 0.2


def in_parallel(
    jobs: Sequence[Callable[[], Result] | None],
    sizes: Sequence[int],
    go_on: Callable[[], None] = lambda: None,
) -> list[Result | None]:
    """What each job returns, None for no job. sizes: pixels of each. go_on: called before each job
    and while they run, in the caller's thread; if it raises, no other job is begun."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    at_once = min(_MOST, cores or 1, max(1, _MOST_PIXELS // max(1, *sizes, 1)))
    with ThreadPoolExecutor(at_once, thread_name_prefix="photos") as pool:
        futures: list[Future[Result] | None] = []
        try:
            for job in jobs:
                go_on()
                futures.append(None if job is None else pool.submit(job))
            running = {item for item in futures if item is not None}
            while running:
                _, running = wait(running, _TICK)
                go_on()
        except BaseException:
            pool.shutdown(wait=True, cancel_futures=True)
            raise
        return [None if item is None else item.result() for item in futures]
