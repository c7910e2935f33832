# SPDX-License-Identifier: GPL-3.0-or-later
"""Options that name photos and say how they were taken."""

from __future__ import annotations

import argparse

from ..scene_read.capture_request import GAINS


def add_captures(parser: argparse._ActionsContainer, photo: str) -> None:
    """--photo with its help, and how photos were taken."""
    many = {"action": "append", "default": []}
    more = "may be given several times, for one camera too: its photos are CAMERA, CAMERA#2, ..."
    parser.add_argument("--photo", **many, metavar="CAMERA=FILE", help=f"{more}; {photo}")
    mask = "black pixels of it do not count; PHOTO: the camera's name, or CAMERA#2 for its second"
    parser.add_argument("--mask", **many, metavar="PHOTO=FILE", help=mask)
    exclude = "white pixels of it do not count"
    parser.add_argument("--exclude", **many, metavar="PHOTO=FILE", help=exclude)
    silhouette = "only what the camera sees of the fitted objects counts, N pixels off its rim"
    parser.add_argument("--silhouette", type=int, metavar="N", help=silhouette)
    background = "border (what joins it in one colour) or R,G,B; with a tolerance: border:0.1"
    parser.add_argument("--background", metavar="WHAT", help=f"it does not count: {background}")
    response = "how code values became of light: auto, srgb, linear, gamma:2.2, or a table"
    parser.add_argument("--response", metavar="NAME|FILE.csv", help=response)
    parser.add_argument("--captures", metavar="FILE.json", help="photos and how they were taken")
    gain = "factor on the render that the fit finds for each photo; default: none"
    parser.add_argument("--gain", choices=GAINS, help=gain)
    parser.add_argument(
        "--align",
        action="store_true",
        default=None,
        help="find a shift and roll of each photo within 4 pixels",
    )
