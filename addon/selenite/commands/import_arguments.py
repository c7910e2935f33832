# SPDX-License-Identifier: GPL-3.0-or-later
"""Options of `selenite import`."""

from __future__ import annotations

import argparse
import re

from .render_arguments import KEPT


def add_import(parser: argparse.ArgumentParser) -> None:
    """What is read, how it is placed, and where the scene goes."""
    # A point such as -0.5,1,2 is an argument and no option; there is no public way to say so.
    parser._negative_number_matcher = re.compile(r"-[.\d][-+.,\deE]*$")
    formats = (
        "Metashape's camera XML, X3D, COLMAP (a file of the model or its folder), NeRF's "
        "transforms.json, XMP or CSV of RealityCapture and RealityScan, Bundler's .out, OBJ, PLY, "
        "glTF"
    )
    parser.add_argument("file", metavar="FILE", help=formats)
    add = parser.add_argument_group("what is read").add_argument
    add("--cameras", metavar="FILE", help="the cameras, where FILE holds the mesh alone")
    photos = "folder of the photos, which are found by the label of their camera"
    add("--photos", metavar="DIR", help=photos)
    add("--masks", metavar="DIR", help="the same of masks, whose black pixels do not count")
    silhouette = (
        "of photos without a mask only what the camera sees of the fitted objects counts, N pixels "
        "off its rim"
    )
    add("--silhouette", type=int, metavar="N", help=silhouette)
    place = parser.add_argument_group("how it is placed")
    unit = place.add_mutually_exclusive_group()
    unit.add_argument(
        "--scale", type=float, metavar="M", help="metres in one unit of FILE; default: as it says"
    )
    unit.add_argument(
        "--scale-points",
        nargs=3,
        metavar=("P", "Q", "M"),
        help="the distance of two points in metres; a point is X,Y,Z in coordinates of FILE, or "
        "the label of a camera",
    )
    add = place.add_argument
    add("--ground", nargs=3, metavar=("P", "Q", "R"), help="three points whose plane becomes z = 0")
    add("--up", choices=("Z", "Y"), default="Z", help="FILE's upward axis (%(default)s)")
    add = parser.add_argument_group("results").add_argument
    undistort = "writes photos without the lens's distortion into the folder OUT_photos"
    add("--undistort", action="store_true", help=undistort)
    add("--save", required=True, metavar="OUT.blend", help=f"the scene, ready to fit{KEPT}")
