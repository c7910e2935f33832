# SPDX-License-Identifier: GPL-3.0-or-later
"""What the panel says where the command line names an option: see `messages.control`."""

from __future__ import annotations

CONTROLS = {
    "give-photo": "press Load Photos, or choose one in the list of captures",
    "undistorted": "tick Undistorted",
    "align": "Align",
    "one-start": "switch Own Start off, or do not start from a file",
    "no-unseen": "set Unseen to Usual",
    "environment-file": "start from a file, or set Projection to Panorama",
    "mirror-ball": "Projection Mirror Ball",
    "fit": "tick",
    "fit-one-model": "Body set to As Ticked",
    "fit-some": "tick parameters, or press Usual",
    "fit-others": "tick the others",
    "next-camera": "Suggest Next Camera",
    "bake": "Bake Unreadable Nodes",
    "approximate": "Approximate Unreadable Materials",
    "new-colors": "add one under Object Data > Color Attributes",
    "resolution": "press Set Resolution, or give the photo Own Size",
}
