# SPDX-License-Identifier: GPL-3.0-or-later
"""The workers of a fit as the native module asks them; dask.distributed decides which does what."""

from __future__ import annotations

import asyncio
import concurrent.futures
import itertools
import statistics
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, cast

from ...messages import thing
from ...problems import BadInput, Problem, listed
from . import worker
from .worker import Share

if TYPE_CHECKING:
    from distributed import Client, Future
    from tornado.platform.asyncio import BaseAsyncIOLoop

    from .parcel import Parcel

#: An answer is late after so many times what others took for the same work, and not before
#: so many seconds; before the first answer after so many.
_LATE, _SOONEST, _FIRST = 20.0, 20.0, 900.0
#: How often a question is asked anew before the fit ends.
_TRIES = 4
#: Seconds for the workers to show what they are.
_CHECK = 300.0


class _NoResult(Exception):
    """A task has no result: it has failed, or its worker is gone."""


class ClusterFailed(RuntimeError):
    """The fit cannot go on with its workers."""


@dataclass
class _Asked:
    """A question, its task, and the answer on its way here. late_of: who has not answered."""

    question: bytes
    work: float
    task: Future
    fetched: concurrent.futures.Future[object]
    since: float
    tries: int = 1
    late_of: set[str] = field(default_factory=set)

    def drop(self) -> None:
        """Nobody waits for this task any more."""
        self.fetched.cancel()
        self.task.release()


class ClusterWorkers:
    """What `core.Fit(workers=)` takes. Answers depend neither on who gives them nor on when."""

    def __init__(
        self,
        client: Client,
        parcel: Parcel,
        *,
        threads: int = 0,
        say: Callable[[str], None] = lambda _: None,
        soonest: float = _SOONEST,
    ) -> None:
        """Sends the parcel to all workers and compares what they are with this process. say: takes
        remarks. soonest: seconds before which nothing is late. Raises BadInput."""
        self._client, self._parcel, self._say, self._soonest = client, parcel, say, soonest
        self._numbers = itertools.count(1)
        self._asked: dict[int, _Asked] = {}
        self._silent: set[str] = set()  # workers that are not asked any more
        self._paces: deque[float] = deque(maxlen=99)  # seconds for a unit of work
        self._lost_since: float | None = None  # the scheduler, by the clock
        processes, self.busy_with = share_of(client)
        self._share = Share(parcel.digest, processes, threads)
        self._data = self._sent()
        self._compare(list(_workers(client)))

    def ask(self, question: bytes, work: float) -> int:
        """Hands on a question of so much work; returns at once."""
        number = next(self._numbers)
        self._asked[number] = _Asked(question, work, *self._submit(question, set()))
        return number

    def answer(self, number: int, seconds: float) -> bytes | None:
        """The answer, or None where there is none after so many seconds. Raises ClusterFailed."""
        asked = self._asked[number]
        if not self._connected():
            time.sleep(seconds)
            return None
        try:
            found = asked.fetched.result(timeout=seconds)
        except concurrent.futures.TimeoutError:
            self._ask_others(asked)
            return None
        except (Exception, concurrent.futures.CancelledError, asyncio.CancelledError) as error:
            if self._connected():
                failed = asked.task.status == "error"
                self._ask_again(asked, asked.task.exception() if failed else error)
            return None
        if not isinstance(found, bytes):
            raise ClusterFailed(f"a worker answers with {type(found).__name__} in place of bytes")
        self._paces.append((time.monotonic() - asked.since) / asked.work)
        self.forget(number)
        return found

    def forget(self, number: int) -> None:
        """Nobody wants the answer."""
        asked = self._asked.pop(number, None)
        if asked is not None:
            asked.drop()

    def _submit(
        self, question: bytes, without: set[str]
    ) -> tuple[Future, concurrent.futures.Future[object], float]:
        """The task, its answer on the way, and now. Silent workers are left out, while there are
        others."""
        others: list[str] = []
        if avoided := self._silent | without:
            others = [name for name in _workers(self._client) if name not in avoided]
            if not others:
                self._silent.clear()
        task = self._client.submit(
            worker.answer, self._data, self._share, question,
            pure=False, workers=others or None, allow_other_workers=False, retries=1,
        )  # fmt: skip

        loop = cast("BaseAsyncIOLoop", self._client.loop).asyncio_loop
        fetched = asyncio.run_coroutine_threadsafe(self._fetch(task), loop)
        return task, fetched, time.monotonic()

    async def _fetch(self, task: Future) -> object:
        """The result of a task, from its worker. The client's own `gather` joins those of several
        tasks, and a worker that hangs would keep the answers of all others. Raises _NoResult."""
        from distributed.utils_comm import gather_from_workers

        done, loop = asyncio.Event(), asyncio.get_running_loop()
        task.add_done_callback(lambda _: loop.call_soon_threadsafe(done.set))
        await done.wait()
        if task.status == "finished":
            where = await self._client.scheduler.who_has(keys=[task.key])
            found = (await gather_from_workers(where, rpc=self._client.rpc))[0]
            if task.key in found:
                return found[task.key]
        raise _NoResult

    def _sent(self) -> Future:
        return self._client.scatter(self._parcel.data, broadcast=True, hash=False)

    def _compare(self, names: list[str]) -> None:
        """Raises BadInput, which names every worker that computes other numbers."""
        here = {**worker.facts_here(), "proof": self._parcel.proof}
        futures = [
            self._client.submit(worker.about, self._data, self._share, workers=[name], pure=False)
            for name in names
        ]
        problems = []
        for name, future in zip(names, futures, strict=True):
            title = thing("Worker", name)
            try:
                there = future.result(timeout=_CHECK)
            except Exception as error:
                cause = f"it cannot render this scene ({type(error).__name__}: {error})"
                cure = f"install selenite[cluster] {here['version']} there, for the same Python"
                problems.append(Problem(title, cause, cure))
                continue
            problems += _differences(title, here, there)
        if problems:
            raise BadInput(problems)

    def _ask_others(self, asked: _Asked) -> None:
        """Where an answer is late, whoever has the question is left alone from now on."""
        took = time.monotonic() - asked.since
        pace = statistics.median(self._paces) if self._paces else 0.0
        late = max(self._soonest, _LATE * pace * asked.work) if pace else _FIRST
        if took < late:
            return
        who = set(self._client.who_has([asked.task]).get(asked.task.key, ()))
        who |= {name for name, keys in self._client.processing().items() if asked.task.key in keys}
        asked.since = time.monotonic()
        if not who:
            return  # it waits for a place
        asked.late_of |= who
        if silent := sorted(who - self._silent):
            self._say(
                f"warning: {listed(silent)} has not answered for {took:.0f} s; others do its work"
            )
        self._silent |= who
        self._renew(asked)

    def _ask_again(self, asked: _Asked, error: BaseException) -> None:
        """A worker has died with the question, or with the scene."""
        if asked.tries >= _TRIES or isinstance(error, (ValueError, KeyError)):
            raise ClusterFailed(f"a worker cannot render a photo: {error}") from error
        asked.tries += 1
        self._data = self._sent()
        self._renew(asked)

    def _renew(self, asked: _Asked) -> None:
        asked.drop()
        asked.task, asked.fetched, asked.since = self._submit(asked.question, asked.late_of)

    def _connected(self) -> bool:
        """Raises ClusterFailed where the scheduler has been away for too long."""
        if self._client.status == "running":
            self._lost_since = None
            return True
        now = time.monotonic()
        self._lost_since = self._lost_since or now
        if self._client.status == "closed" or now - self._lost_since > self._soonest:
            raise ClusterFailed(
                "the scheduler does not answer; start it again, and go on with --resume"
            )
        return False


def share_of(client: Client) -> tuple[int, int]:
    """Workers of a machine at most, and how many tasks all of them take at once. Raises
    BadInput."""
    known = _workers(client).values()
    if not known:
        raise BadInput(Problem("Cluster", "it has no worker", "start one with dask worker"))
    hosts = [str(about["host"]) for about in known]
    at_once = sum(int(about["nthreads"]) for about in known)
    return max(hosts.count(host) for host in hosts), at_once


def _workers(client: Client) -> dict[str, dict]:
    return client.scheduler_info(n_workers=-1)["workers"]


def _differences(title: str, here: dict, there: dict) -> list[Problem]:
    if there["version"] != here["version"]:
        cause = f"it has version {there['version']}, the fit is {here['version']}"
        return [Problem(title, cause, "install the same version there")]
    if there["lanes"] != here["lanes"]:
        words = {True: "traces eight paths at a time", False: "traces paths one by one"}
        cause = f"it {words[there['lanes']]}, the fit {words[here['lanes']]}"
        cure = "use processors that all have AVX2, or set SELENITE_AVX2=0 on each machine"
        return [Problem(title, cause, cure)]
    if there["proof"] != here["proof"]:
        cause = "it renders other numbers of the same scene"
        return [Problem(title, cause, "use the same build of Selenite and the same system there")]
    return []
