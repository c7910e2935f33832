# SPDX-License-Identifier: GPL-3.0-or-later
"""A connection to the scheduler of a cluster, or to processes of this machine."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from ...problems import BadInput, Problem
from .address import Address

if TYPE_CHECKING:
    from distributed import Client

#: Photos that a local process renders at once: one keeps its core busy while another travels.
_AT_ONCE = 2
#: Seconds for a scheduler to answer.
_PATIENCE = 20.0


@contextmanager
def connected(address: Address) -> Iterator[Client]:
    """Raises BadInput where dask.distributed is not installed, or nobody answers."""
    try:
        import distributed
    except ImportError as error:
        cause = f"it needs dask.distributed, which is not installed ({error})"
        cure = "run: pip install 'selenite[cluster]'; the extension of Blender cannot use a cluster"
        raise BadInput(Problem("Argument --scheduler", cause, cure)) from error
    logging.getLogger("distributed").setLevel(logging.ERROR)
    if address.local:
        with _local(address.local) as client:
            yield client
        return
    try:
        client = distributed.Client(
            address.url, timeout=_PATIENCE, set_as_default=False, direct_to_workers=True
        )
    except (OSError, TypeError, ValueError, RuntimeError) as error:
        cause = f"no scheduler answers at {address.url} ({error})"
        cure = "start dask scheduler there"
        if address.url.startswith("tls:"):
            cure += ", and give the certificates by dask's settings distributed.comm.tls"
        raise BadInput(Problem("Argument --scheduler", cause, cure)) from error
    with client:
        yield client


@contextmanager
def _local(count: int) -> Iterator[Client]:
    """Processes of this machine."""
    import distributed

    cluster = distributed.LocalCluster(
        n_workers=count, threads_per_worker=_AT_ONCE, processes=True, host="127.0.0.1",
        dashboard_address="127.0.0.1:0", silence_logs=logging.CRITICAL,
    )  # fmt: skip
    client = distributed.Client(cluster, set_as_default=False, direct_to_workers=True)
    try:
        yield client
    finally:
        for one in (client, cluster):
            # One that hangs is killed, which may take longer than dask waits.
            with suppress(TimeoutError):
                one.close()
