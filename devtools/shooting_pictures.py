# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws the pictures of docs/guide/shooting.md: python devtools/shooting_pictures.py"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402 - after the backend is chosen
import numpy as np  # noqa: E402
from matplotlib.axes import Axes  # noqa: E402
from matplotlib.patches import Circle, FancyArrow, Rectangle, Wedge  # noqa: E402

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "pictures"
INK, LIGHT, GOOD, BAD = "#333333", "#e8a33d", "#3a7d44", "#b8402a"


def plain(axes: Axes, title: str, limits: tuple[float, float, float, float]) -> None:
    axes.set_title(title, fontsize=9, color=INK)
    axes.set_xlim(limits[0], limits[1])
    axes.set_ylim(limits[2], limits[3])
    axes.set_aspect("equal")
    axes.axis("off")


def camera(axes: Axes, x: float, y: float, towards: tuple[float, float], color: str = INK) -> None:
    angle = np.degrees(np.arctan2(towards[1] - y, towards[0] - x))
    axes.add_patch(Wedge((x, y), 0.55, angle - 14, angle + 14, color=color, alpha=0.25, lw=0))
    axes.add_patch(Circle((x, y), 0.13, color=color))


def lamp(axes: Axes, x: float, y: float) -> None:
    axes.add_patch(Circle((x, y), 0.15, color=LIGHT))
    for angle in np.arange(0, 2 * np.pi, np.pi / 4):
        dx, dy = np.cos(angle), np.sin(angle)
        axes.plot([x + 0.2 * dx, x + 0.3 * dx], [y + 0.2 * dy, y + 0.3 * dy], color=LIGHT, lw=1)


def body(axes: Axes) -> None:
    axes.add_patch(Circle((0, 0), 0.4, color="#7aa6b8"))


def setup() -> None:
    figure, (round_view, lamps) = plt.subplots(1, 2, figsize=(7, 3))
    plain(round_view, "cameras around a body that stays", (-2.2, 2.2, -1.7, 1.7))
    body(round_view)
    for angle in np.radians([0, 40, 80, 120, 180, 230, 280, 320]):
        camera(round_view, 1.4 * np.cos(angle), 1.4 * np.sin(angle), (0, 0))
    lamp(round_view, 1.9, 1.35)
    round_view.text(1.9, 0.95, "lamp", ha="center", fontsize=8, color=INK)
    plain(lamps, "front, side and back light tell more", (-2.2, 2.2, -1.7, 1.7))
    body(lamps)
    camera(lamps, 0, -1.4, (0, 0))
    for x, y, name in ((1.3, -1.0, "front"), (1.7, 0.5, "side"), (-0.3, 1.35, "back")):
        lamp(lamps, x, y)
        lamps.text(x + 0.35, y - 0.05, name, fontsize=8, color=INK)
    save(figure, "shooting_setup")


def exposure() -> None:
    figure, axes = plt.subplots(1, 3, figsize=(7, 1.9), sharey=True)
    codes = np.linspace(0, 255, 256)
    for part, (title, shift, good) in zip(
        axes, (("too dark", -90, False), ("good", 0, True), ("clipped", 95, False)), strict=True
    ):
        counts = np.exp(-(((codes - 110 - shift) / 55) ** 2))
        if shift > 0:
            counts[-3:] = 1.4
        part.fill_between(codes, counts, color=GOOD if good else BAD, lw=0)
        part.set_title(title, fontsize=9, color=INK)
        part.set_yticks([])
        part.set_xticks([0, 255])
        part.tick_params(labelsize=7)
        part.set_xlabel("code value", fontsize=8, labelpad=-6)
    save(figure, "shooting_exposure")


def response() -> None:
    figure, (curves, card) = plt.subplots(1, 2, figsize=(7, 2.6))
    light = np.linspace(0, 1, 200)
    curves.plot(light, light, color=GOOD, label="linear, from RAW")
    srgb = np.where(light <= 0.0031308, light * 12.92, 1.055 * light ** (1 / 2.4) - 0.055)
    curves.plot(light, srgb, color=INK, ls="--", label="sRGB")
    toned = 0.4 * srgb + 0.6 * (3 * srgb**2 - 2 * srgb**3)
    curves.plot(light, toned, color=BAD, label="tone curve of a camera")
    curves.set_xlabel("light", fontsize=8)
    curves.set_ylabel("code value", fontsize=8)
    curves.tick_params(labelsize=7)
    curves.legend(fontsize=7, frameon=False, loc="lower right")
    plain(card, "a grey card in the first photo", (-0.2, 4.4, -0.6, 2.2))
    for index, value in enumerate((0.03, 0.09, 0.19, 0.36, 0.59, 0.9)):
        shade = str(min(1.0, 1.055 * value ** (1 / 2.4) - 0.055))
        corner = (0.1 + 0.7 * index, 0.7)
        card.add_patch(Rectangle(corner, 0.7, 0.9, facecolor=shade, edgecolor=INK, lw=0.5))
        card.text(corner[0] + 0.35, 0.45, f"{value:.2f}", ha="center", fontsize=7, color=INK)
    card.text(2.2, 0.0, "reflectance of the patches", ha="center", fontsize=8, color=INK)
    save(figure, "shooting_response")


def masks() -> None:
    """A ball before a cluttered room: what each mask keeps, and all of them without the rim."""
    size = 72
    y, x = np.mgrid[:size, :size] / (size - 1) * 2 - 1
    radius = np.hypot(x, y)
    height = np.sqrt(np.clip(0.55**2 - radius**2, 0, None)) / 0.55
    ball = radius < 0.55
    shade = np.clip(0.15 + 0.8 * (0.5 * height - 0.6 * x - 0.5 * y), 0.05, 1)
    room = 0.45 + 0.25 * np.sin(9 * x + 3 * np.sin(7 * y)) * np.cos(5 * y)
    hand = (np.abs(x - 0.55) < 0.12) & (y > 0.1)
    photo = np.dstack(
        [np.where(ball, shade * c, room * d) for c, d in ((0.9, 0.8), (0.6, 0.9), (0.4, 1))]
    )
    photo[hand] = (0.85, 0.6, 0.5)
    seen = radius < 0.53
    kept = seen & ~hand
    rim = kept.copy()
    for axis in (0, 1):
        rim &= np.roll(kept, 1, axis) & np.roll(kept, -1, axis)
    shown = np.where(rim[..., None], photo, 0)
    figure, axes = plt.subplots(1, 4, figsize=(7, 2))
    for part, picture, title in zip(
        axes,
        (photo, seen, hand, shown),
        ("photo", "silhouette", "exclude (white)", "what counts"),
        strict=True,
    ):
        part.imshow(picture, cmap="gray", interpolation="nearest", vmin=0, vmax=1)
        part.set_title(title, fontsize=9, color=INK)
        part.axis("off")
    save(figure, "shooting_masks")


def room() -> None:
    figure, (sphere, stops) = plt.subplots(1, 2, figsize=(7, 2.4))
    plain(sphere, "a panorama from where the body stands", (-2.2, 2.2, -1.4, 1.4))
    sphere.add_patch(Circle((0, 0), 1.2, fill=False, color=INK, lw=1))
    sphere.add_patch(Circle((0, 0), 0.12, color=INK))
    for angle in np.radians(np.arange(0, 360, 45)):
        dx, dy = 0.75 * np.cos(angle), 0.75 * np.sin(angle)
        sphere.add_patch(FancyArrow(0, 0, dx, dy, width=0.012, head_width=0.1, color=LIGHT, lw=0))
    plain(stops, "five exposures, two stops apart", (-0.2, 5.4, -0.5, 1.6))
    for index, factor in enumerate((1 / 16, 1 / 4, 1, 4, 16)):
        row = np.clip(np.linspace(0.02, 0.9, 12) * factor, 0, 1) ** (1 / 2.2)
        stops.imshow(
            np.tile(row, (6, 1)), cmap="gray", vmin=0, vmax=1, aspect="auto",
            extent=(1.04 * index, 1.04 * index + 0.96, 0.2, 1.2),
        )  # fmt: skip
        stops.add_patch(Rectangle((1.04 * index, 0.2), 0.96, 1, fill=False, ec=INK, lw=0.5))
        text = f"{factor:g}" if factor >= 1 else f"1/{1 / factor:.0f}"
        stops.text(1.04 * index + 0.48, -0.15, text, ha="center", fontsize=8, color=INK)
    stops.set_xlim(-0.2, 5.4)
    save(figure, "shooting_room")


def save(figure: plt.Figure, name: str) -> None:
    figure.tight_layout()
    figure.savefig(FOLDER / f"{name}.png", dpi=80, metadata={"Software": None})
    plt.close(figure)


PICTURES: tuple[Callable[[], None], ...] = (setup, exposure, response, masks, room)

if __name__ == "__main__":
    for draw in PICTURES:
        draw()
