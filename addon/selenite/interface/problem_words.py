# SPDX-License-Identifier: GPL-3.0-or-later
"""Problems in the words of the panel: no options of the command line."""

from __future__ import annotations

import re

#: What the command line says -> what the panel says; the first that matches counts.
_PHRASES = (
    (r"give one with --photo CAMERA=FILE or in the Captures panel", "press Load Photos, or choose "
     "one in the list of captures"),
    (r"give its 'size', .* to the same aspect", "press Set Resolution, or give the photo Own Size"),
    (r"give --start or a file with --grid", "switch Own Start off, or start from a file"),
    (r"give --start or a file", "switch Own Start off, or do not start from a file"),
    (r"leave --unseen out", "set Unseen to Usual"),
    (r"take it out, or add --fit (\S+)", r"take it out, or tick \1"),
    (r"name the parameters, as in --fit \S+", "tick parameters, or press Usual"),
    (r"name the others with --fit or the ticks of the panel", "tick the others"),
    (r"see selenite fit --help", "see the manual"),
)  # fmt: skip
_OPTION = re.compile(r"--([a-z][a-z-]*)(?:[ =][A-Z][A-Z:=,.\[\]]*)?")
#: Option -> control.
_CONTROLS = {
    "photo": "Load Photos", "mask": "Mask", "captures": "Captures", "fit": "the ticks",
    "start": "Own Start", "bounds": "Min and Max", "grid": "Start From", "unseen": "Unseen",
    "spp": "Samples", "height": "Height", "search": "Multi-Start", "gain": "Gain",
    "align": "Align", "response": "Response", "background": "Background", "exclude": "Exclude",
    "silhouette": "Silhouette", "resume": "Resume a Run", "stages": "Stages", "loss": "Loss",
    "bake": "Bake Unreadable Nodes", "approximate": "Approximate Unreadable Materials",
    "preset": "Quality", "out": "Folder", "threads": "Threads", "iterations": "Iterations",
}  # fmt: skip


def in_panel_words(text: str) -> str:
    """`text` with each option of the command line replaced by the control that does the same."""
    for pattern, words in _PHRASES:
        text = re.sub(pattern, words, text)
    return _OPTION.sub(lambda found: _CONTROLS.get(found[1], found[1].replace("-", " ")), text)
