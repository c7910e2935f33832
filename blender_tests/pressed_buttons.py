# SPDX-License-Identifier: GPL-3.0-or-later
"""Modal operators without a window: what a button starts, and the events that it gets."""

import time
from functools import partial
from types import SimpleNamespace

ESCAPE = SimpleNamespace(type="ESC", value="PRESS")
TIMER = SimpleNamespace(type="TIMER", value="NOTHING")


def until_over(operator, context, longest=60.0):
    """What a modal operator returns at last: a thread of its may still be at work at a tick."""
    until = time.monotonic() + longest
    ended = operator.modal(context, TIMER)
    while ended == {"PASS_THROUGH"} and time.monotonic() < until:
        time.sleep(0.01)
        ended = operator.modal(context, TIMER)
    return ended


class Pressed:
    """All methods of an operator, in Python alone: it has no timer, `said` keeps its reports."""

    def __init__(self, operator):
        self._operator = operator
        self.said = []

    def report(self, *words):
        self.said.append(words)

    def _remove_timer(self, _context):
        pass

    def __getattr__(self, name):
        found = getattr(self._operator, name)
        return partial(found, self) if callable(found) else found
