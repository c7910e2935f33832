# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws the picture of docs/guide/reconstruction.md from what scenes/reconstruction.py has written:

python scenes/reconstruction.py --out FOLDER --fit
python devtools/reconstruction_pictures.py FOLDER
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402 - after the backend is chosen
import numpy as np  # noqa: E402

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
    figure, axes = plt.subplots(1, len(pictures), figsize=(10, 2.3))
    for panel, (title, pixels) in zip(axes, pictures.items(), strict=True):
        panel.imshow(pixels, interpolation="nearest")
        panel.set_title(title, fontsize=9, color="#333333")
        panel.axis("off")
    figure.tight_layout()
    figure.savefig(ROOT / "docs" / "pictures" / "reconstruction.png", dpi=110)


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve())
