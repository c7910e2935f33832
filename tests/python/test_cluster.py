# SPDX-License-Identifier: GPL-3.0-or-later
"""What goes to workers of a cluster, and who may be asked."""

from __future__ import annotations

import math

import numpy as np
import pytest

from selenite.fit.cluster.address import Address, address_of
from selenite.fit.cluster.plain import packed, unpacked
from selenite.problems import BadInput


def test_plain_values_come_back_as_they_were() -> None:
    pixels = np.arange(12, dtype=np.float32).reshape(2, 2, 3)
    value = {
        "name": "Körper", "none": None, "numbers": [1, -2.5, math.inf, 1 << 63, True],
        ("pair",): {"deep": pixels}, "empty": np.zeros((0, 3), np.int32), "one": np.float64(0.1),
    }  # fmt: skip
    value.pop(("pair",))  # keys are texts and numbers
    value["pair"] = {"deep": pixels}
    found = unpacked(packed(value))
    assert found["numbers"] == [1, -2.5, math.inf, 1 << 63, True]
    assert (found["name"], found["none"], found["one"]) == ("Körper", None, 0.1)
    assert found["pair"]["deep"].dtype == np.float32
    assert np.array_equal(found["pair"]["deep"], pixels)
    assert found["empty"].shape == (0, 3)


def test_plain_values_are_in_no_pickle() -> None:
    with pytest.raises(TypeError, match="object is no plain value"):
        packed({"what": object()})
    with pytest.raises(TypeError, match="array of object"):
        packed(np.array([object()]))
    good = packed({"a": np.ones(4)})
    for bad in (b"", b"\x80\x04N.", good[:-1], good.replace(b"<f8", b"|O8")):
        with pytest.raises(ValueError):
            unpacked(bad)


@pytest.mark.parametrize(
    "text", ["tcp://localhost:8786", "tcp://127.0.0.1:1", "tcp://[::1]:8786", "tls://far.org:8786"]
)
def test_a_connection_that_nobody_reads_is_taken(text: str) -> None:
    assert address_of(text) == Address(url=text)


@pytest.mark.parametrize(
    "text", ["tcp://192.168.0.7:8786", "tcp://far.org:8786", "tcp://[fe80::1]:1"]
)
def test_an_unencrypted_one_to_another_machine_is_asked_for(text: str) -> None:
    with pytest.raises(BadInput, match="is not encrypted.*--unencrypted"):
        address_of(text)
    assert address_of(text, unencrypted=True).url == text


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("far.org:8786", "no address"), ("http://far.org:8786", "no address"),
        ("tcp://far.org", "no address"), ("tcp://far.org:70000", "no address"),
        ("local:", "no address"), ("local:0", "0 local workers"), ("local:9999", "9999 local"),
    ],
)  # fmt: skip
def test_what_is_no_address_is_refused(text: str, words: str) -> None:
    with pytest.raises(BadInput, match=words):
        address_of(text, unencrypted=True)


def test_local_workers_are_counted() -> None:
    assert address_of("local:2") == Address(local=2)
    assert str(address_of("local:2")) == "local:2"
