# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws the picture of docs/guide/reconstruction.md from what scenes/reconstruction.py has written:

python scenes/reconstruction.py --out FOLDER --fit
python devtools/reconstruction_pictures.py FOLDER
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import picture_row

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "addon"))
PHOTO = "IMG_0002"
TIMES = 10.0  # the difference is shown so many times as large


def main(folder: Path) -> None:
    from selenite import native

    image = native.image()

    def shown(path: Path) -> np.ndarray:
        return np.asarray(image.srgb_encode(np.clip(image.read(str(path))[0], 0, 1)))

    result = max((folder / "fits" / "metashape").glob("2*"))
    reference, optimised = (
        image.read(str(result / f"{PHOTO}_{kind}.exr"))[0] for kind in ("reference", "optimised")
    )
    pictures = {
        "the photo": shown(folder / "photos" / f"{PHOTO}.exr"),
        "without distortion": shown(result / f"{PHOTO}_reference.exr"),
        "render at the fitted values": shown(result / f"{PHOTO}_optimised.exr"),
        f"difference, {TIMES:.0f} times": np.clip(TIMES * np.abs(reference - optimised), 0, 1),
    }
    picture_row.write(ROOT / "docs" / "pictures" / "reconstruction.png", pictures, (10, 2.3), 110)


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve())
