# SPDX-License-Identifier: GPL-3.0-or-later
"""--scheduler and what belongs to it; importing neither Blender nor dask."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from .terminal import say

if TYPE_CHECKING:
    from distributed import Client

    from ..fit.cluster.workers import ClusterWorkers
    from ..fit.plan import FitPlan


def add_scheduler(add: Callable[..., object], work: str) -> None:
    """work: what workers do."""
    scheduler = f"dask scheduler whose workers {work}: tcp://HOST:PORT, tls://HOST:PORT, or "
    scheduler += "local:N for N processes of this machine"
    add("--scheduler", metavar="ADDRESS", help=scheduler)
    unencrypted = "permits tcp:// to another machine"
    add("--unencrypted", action="store_true", help=unencrypted)


@contextmanager
def client_for(args: argparse.Namespace) -> Iterator[Client]:
    """Of the scheduler that --scheduler names. Raises BadInput."""
    from ..fit.cluster.address import address_of
    from ..fit.cluster.scheduler import connected

    with connected(address_of(args.scheduler, unencrypted=args.unencrypted)) as client:
        yield client


@contextmanager
def workers_for(args: argparse.Namespace, plan: FitPlan) -> Iterator[ClusterWorkers | None]:
    """Those that --scheduler names; None without it. Raises BadInput."""
    if not args.scheduler:
        yield None
        return
    from ..fit.cluster.parcel import parcel_of
    from ..fit.cluster.workers import ClusterWorkers

    with client_for(args) as client:
        workers = ClusterWorkers(
            client, parcel_of(plan), threads=plan.request.settings.threads, say=say
        )
        say(f"cluster: {workers.busy_with} photos are rendered at once")
        yield workers
