# SPDX-License-Identifier: GPL-3.0-or-later
"""The workers of a fit as the native module asks them; dask.distributed decides which does what.

A question whose answer is late gets a second attempt, by another worker or by this process: the
first answer counts. So the fit goes on whatever its workers do, as long as the scheduler lives.
"""

from __future__ import annotations

import asyncio
import concurrent.futures
import itertools
import statistics
import time
from collections import deque
from collections.abc import Callable, Coroutine
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeVar, cast

from ...problems import BadInput, Problem, listed
from . import worker
from .comparison import compare
from .opened import opened
from .worker import Share

if TYPE_CHECKING:
    from distributed import Client, Future
    from tornado.platform.asyncio import BaseAsyncIOLoop

    from ..._core import StageWorker
    from .parcel import Parcel

#: An answer is late after so many times what others took for the same work, and not before
#: so many seconds; before the first answer after so many. A false alarm costs one more render.
_LATE, _SOONEST, _FIRST = 5.0, 20.0, 900.0
#: How often workers may fail with a question before the fit ends.
_TRIES = 4
#: Seconds for the workers to get the scene and to show what they are, and for one that joins later.
_CHECK, _CHECK_LATER = 300.0, 60.0


_T = TypeVar("_T")


class _NoResult(Exception):
    """A task has no result: it has failed, or its worker is gone."""


class ClusterFailed(RuntimeError):
    """The fit cannot go on with its workers."""


@dataclass
class _Attempt:
    """An answer on its way here, and the worker's name. task: of a worker; None: of this
    process."""

    fetched: concurrent.futures.Future[tuple[object, str]]
    task: Future | None
    since: float

    def drop(self) -> None:
        """Nobody waits for it any more."""
        self.fetched.cancel()
        if self.task is not None:
            self.task.release()


@dataclass
class _Asked:
    """A question, and what is done for its answer. failures: of workers. late: workers that have
    not answered in time."""

    question: bytes
    work: float
    attempts: list[_Attempt]
    failures: int = 0
    late: set[str] = field(default_factory=set)


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
        self._silent: dict[str, Future] = {}  # worker that is not asked -> what it does first
        self._known: dict[str, float] = {}  # worker -> since when it knows the fit, by the clock
        self._refused: set[str] = set()  # workers that joined later and compute other numbers
        self._paces: deque[float] = deque(maxlen=99)  # seconds for a unit of work
        self._lost_since: float | None = None  # the scheduler, by the clock
        self._here: StageWorker | None = None
        self._thread_here = concurrent.futures.ThreadPoolExecutor(1)
        processes, self.busy_with = share_of(client)
        self._share = Share(parcel.digest, processes, threads)
        try:
            self._introduce(list(_workers(client)), _CHECK)
        except TimeoutError as error:
            cause = f"its workers have not taken the scene within {_CHECK:.0f} s"
            raise BadInput(Problem("Cluster", cause, "end workers that hang")) from error

    def ask(self, question: bytes, work: float) -> int:
        """Hands on a question of so much work; returns at once."""
        number = next(self._numbers)
        self._asked[number] = asked = _Asked(question, work, [])
        self._attempt(asked)
        return number

    def answer(self, number: int, seconds: float) -> bytes | None:
        """The answer, or None where there is none after so many seconds. Raises ClusterFailed."""
        asked = self._asked[number]
        if not self._connected():
            time.sleep(seconds)
            return None
        self._welcome()
        fetched = [one.fetched for one in asked.attempts]
        if not concurrent.futures.wait(fetched, seconds, "FIRST_COMPLETED").done:
            self._ask_others(asked)
            return None
        done = next(one for one in asked.attempts if one.fetched.done())
        try:
            found, name = done.fetched.result()
        except Exception as error:
            if self._connected():
                self._give_up(asked, done, error)
            return None
        if found is None:
            self._introduce_later(name, done.since)
            self._remove(asked, done)
            return None
        if not isinstance(found, bytes):
            raise ClusterFailed(f"a worker answers with {type(found).__name__} in place of bytes")
        self._paces.append((time.monotonic() - done.since) / asked.work)
        self.forget(number)
        return found

    def forget(self, number: int) -> None:
        """Nobody wants the answer."""
        asked = self._asked.pop(number, None)
        for attempt in asked.attempts if asked is not None else ():
            attempt.drop()

    def _attempt(self, asked: _Asked) -> None:
        """By a worker that is neither silent nor late with this question; else by this process."""
        others: list[str] = []
        if avoided := {*self._silent, *self._refused, *asked.late}:
            others = [name for name in _workers(self._client) if name not in avoided]
            if not others:
                self._attempt_here(asked)
                return
        task = self._client.submit(
            worker.answer, self._share, asked.question,
            pure=False, workers=others or None, allow_other_workers=False, retries=1,
        )  # fmt: skip
        asked.attempts.append(_Attempt(self._soon(self._fetch(task)), task, time.monotonic()))

    def _attempt_here(self, asked: _Asked) -> None:
        fetched = self._thread_here.submit(self._answer_here, asked.question)
        asked.attempts.append(_Attempt(fetched, None, time.monotonic()))

    def _answer_here(self, question: bytes) -> tuple[object, str]:
        if self._here is None:
            self._here, _ = opened(self._parcel.data, self._share.threads)
        return self._here.answer(question), ""

    def _soon(self, work: Coroutine[object, object, _T]) -> concurrent.futures.Future[_T]:
        """Begins it in the thread of the client."""
        loop = cast("BaseAsyncIOLoop", self._client.loop).asyncio_loop
        return asyncio.run_coroutine_threadsafe(work, loop)

    async def _fetch(self, task: Future) -> tuple[object, str]:
        """The result of a task, and its worker. The client's own `gather` joins those of several
        tasks, and a worker that hangs would keep the answers of all others. Raises _NoResult."""
        from distributed.utils_comm import gather_from_workers

        done, loop = asyncio.Event(), asyncio.get_running_loop()
        task.add_done_callback(lambda _: loop.call_soon_threadsafe(done.set))
        await done.wait()
        if task.status == "finished":
            where = await self._client.scheduler.who_has(keys=[task.key])
            found = (await gather_from_workers(where, rpc=self._client.rpc))[0]
            if task.key in found:
                return found[task.key], next(iter(where[task.key]))
        raise _NoResult

    def _introduce(self, names: list[str], seconds: float) -> None:
        """Makes workers know the fit. Raises BadInput, or a TimeoutError where they do not take
        the scene."""
        sending = self._client.scatter(
            self._parcel.data, workers=names, broadcast=True, hash=False, asynchronous=True
        )
        data = cast("Future", self._soon(sending).result(seconds))
        compare(self._client, names, self._parcel, data, self._share, seconds)
        self._known.update(dict.fromkeys(names, time.monotonic()))

    def _introduce_later(self, name: str, since: float) -> None:
        """The same of a worker that has joined since, or has forgotten the fit. since: when it was
        asked."""
        if name in self._refused or since < self._known.get(name, 0.0):
            return
        try:
            self._introduce([name], _CHECK_LATER)
        except (BadInput, OSError) as error:  # also of time
            self._refused.add(name)
            self._say(f"warning: {name} is not asked: {error or 'it does not take the scene'}")

    def _ask_others(self, asked: _Asked) -> None:
        """Where an answer is late, another attempt is made. Whoever has the question is asked for
        nothing else until it answers."""
        task, took = asked.attempts[-1].task, time.monotonic() - asked.attempts[-1].since
        pace = statistics.median(self._paces) if self._paces else 0.0
        late = max(self._soonest, _LATE * pace * asked.work) if pace else _FIRST
        if took < late or task is None:
            return
        key = task.key
        who = set(self._client.who_has([task]).get(key, ()))
        who |= {name for name, keys in self._client.processing().items() if key in keys}
        if silent := sorted(who - set(self._silent)):
            self._say(
                f"warning: {listed(silent)} has not answered for {took:.0f} s; others do its work"
            )
        for name in silent:
            self._silent[name] = self._client.submit(
                worker.facts_here, pure=False, workers=[name], allow_other_workers=False, priority=1
            )
        asked.late |= who
        if who:
            self._attempt(asked)
        else:  # it waits for a place, perhaps of a worker that hangs
            self._attempt_here(asked)

    def _welcome(self) -> None:
        """Silent workers that do something again are asked again."""
        for name, first in list(self._silent.items()):
            if first.status == "finished":
                del self._silent[name]
                self._say(f"{name} answers again")

    def _give_up(self, asked: _Asked, attempt: _Attempt, error: BaseException) -> None:
        """A worker has died with the question."""
        if attempt.task is not None and attempt.task.status == "error":
            error = attempt.task.exception() or error
        asked.failures += 1
        if asked.failures >= _TRIES or isinstance(error, (ValueError, KeyError)):
            raise ClusterFailed(f"a worker cannot render a photo: {error}") from error
        self._remove(asked, attempt)

    def _remove(self, asked: _Asked, attempt: _Attempt) -> None:
        """Another one takes the place of the last."""
        asked.attempts.remove(attempt)
        attempt.drop()
        if not asked.attempts:
            self._attempt(asked)

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
