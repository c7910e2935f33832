# SPDX-License-Identifier: GPL-3.0-or-later
"""The commands of `selenite` in this process."""

import json

from selenite.cli import main


def command(capsys, *words):
    """(exit status, the JSON object, what was printed for people) of one command.

    bpy prints to Python's stdout as well: the object is the last line there.
    """
    capsys.readouterr()
    status = main([*words, "--json"])
    printed = capsys.readouterr()
    return status, json.loads(printed.out.splitlines()[-1]), printed.err
