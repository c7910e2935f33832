# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps of a fit by any number of workers, of measured times and modelled links."""

from __future__ import annotations

import heapq
from dataclasses import dataclass, replace

import numpy as np


@dataclass
class Parts:
    """A question: seconds to answer it, and bytes of both."""

    seconds: float
    sent: int
    received: int


@dataclass
class Model:
    """Steps as batches of pictures, each of which ends before the next begins. each: seconds of the
    fit for a picture, once it has all of a batch. way, asking: seconds of a question to a worker
    and back, and those of them that keep the fit from other work. slower: a worker takes so many
    times what the same picture takes here."""

    batches: list[list[Parts]]
    steps: int
    each: float
    way: float
    asking: float
    slower: float = 1.0

    def step(self, workers: int, bandwidth: float = np.inf, latency: float = 0.0) -> float:
        """Mean seconds with so many workers of a thread each; photos go to whoever is free first,
        all bytes over the one link of the fit."""
        ends = (self._end(batch, workers, bandwidth, latency) for batch in self.batches)
        return sum(ends) / self.steps

    def _end(self, batch: list[Parts], workers: int, bandwidth: float, latency: float) -> float:
        free = [0.0] * workers
        link, arrivals = 0.0, []
        for index, picture in enumerate(batch):
            asked = (index + 1) * self.asking + picture.sent / bandwidth
            begin = max(heapq.heappop(free), asked + self.way / 2 + latency)
            end = begin + self.slower * picture.seconds
            heapq.heappush(free, end)
            arrivals.append((end, picture.received))
        for done, size in arrivals:  # they are wanted in this order
            link = max(link, done) + size / bandwidth
        return link + latency + self.way / 2 + len(batch) * self.each

    def of_photos(self, photos: int) -> Model:
        """The same of so many photos."""
        batches = [(one * -(-photos // len(one)))[:photos] for one in self.batches]
        return replace(self, batches=batches)

    def calibrated(self, measured: float) -> Model:
        """With workers of the pace that makes a step of one worker take so many seconds."""
        busy = sum(one.seconds for batch in self.batches for one in batch) / self.steps
        return replace(self, slower=self.slower + (measured - self.step(1)) / busy)
