# SPDX-License-Identifier: GPL-3.0-or-later
"""What a photo or mask says, and what in it cannot be used, reaches the user by name."""

from __future__ import annotations

import errno
import struct
import sys
import zlib
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "addon"))

pytest.importorskip("selenite._image", reason="the native module is not built")
import OpenEXR  # noqa: E402

from selenite import native  # noqa: E402
from selenite.capture import prepared  # noqa: E402
from selenite.capture.prepared import Capture, read_captures  # noqa: E402
from selenite.capture.request import CaptureRequest  # noqa: E402
from selenite.problems import Problem  # noqa: E402

WIDTH, HEIGHT = 16, 12


def read(
    photo: Path, mask: Path | None = None, height: int = HEIGHT, size: tuple[int, int] | None = None
) -> tuple[Capture | None, list[Problem], list[str]]:
    """As a fit reads it, for one camera of the photo's size."""
    width, rows = size or (WIDTH, HEIGHT)
    camera = SimpleNamespace(
        name="Camera", width=width, height=rows, aspect=width / rows, lens=None
    )
    scene = SimpleNamespace(cameras=[camera], unusable_cameras={})
    problems: list[Problem] = []
    warnings: list[str] = []
    request = CaptureRequest("Camera", str(photo), "" if mask is None else str(mask))
    found = read_captures(scene, [request], height, problems, warnings, {})
    return (found[0] if found else None), problems, warnings


def write_exr(path: Path, pixels: np.ndarray, **header: object) -> Path:
    fields = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **header}
    names = {"RGB": pixels} if pixels.ndim == 3 else {"Y": pixels}
    names = {name: np.ascontiguousarray(value, np.float32) for name, value in names.items()}
    OpenEXR.File(fields, names).write(str(path))
    return path


def write_png(path: Path, codes: np.ndarray, *chunks: tuple[bytes, bytes]) -> Path:
    """codes: (h, w, 3) or (h, w) of 8 or 16 bits."""

    def chunk(name: bytes, data: bytes) -> bytes:
        return (
            struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
        )

    height, width = codes.shape[:2]
    bits, kind = 8 * codes.dtype.itemsize, 2 if codes.ndim == 3 else 0
    rows = codes.astype(codes.dtype.newbyteorder(">"))
    body = zlib.compress(b"".join(b"\0" + row.tobytes() for row in rows))
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, bits, kind, 0, 0, 0))
        + b"".join(chunk(name, data) for name, data in chunks)
        + chunk(b"IDAT", body)
        + chunk(b"IEND", b"")
    )
    return path


def plain() -> np.ndarray:
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH] / WIDTH
    return np.stack([0.1 + 0.5 * x, 0.2 + 0.3 * y, 0.3 + 0.2 * x * y], axis=-1)


def test_nan_infinite_and_negative_pixels_have_no_weight_and_are_counted(tmp_path: Path) -> None:
    pixels = plain()
    pixels[0, :5] = np.nan
    pixels[1, 0, 2] = np.inf
    pixels[2, :3, 0] = -0.1
    capture, problems, warnings = read(write_exr(tmp_path / "a.exr", pixels))
    assert not problems
    assert capture is not None
    usable = np.isfinite(pixels).all(axis=2) & (np.nan_to_num(pixels) >= 0).all(axis=2)
    assert np.array_equal(capture.weight > 0, usable)
    assert np.isfinite(capture.reference).all()
    assert np.allclose(capture.reference[usable], pixels[usable], atol=1e-6)
    title = f"Photo '{tmp_path / 'a.exr'}'"
    assert warnings == [
        f"{title}: 6 of its pixels are not finite (NaN or infinite) and left out",
        f"{title}: 3 of its pixels are below 0 and left out",
    ]
    assert list(capture.warnings) == warnings


def test_a_photo_without_a_usable_pixel_is_a_problem_with_its_reasons(tmp_path: Path) -> None:
    pixels = np.full((HEIGHT, WIDTH, 3), np.nan)
    pixels[: HEIGHT // 4] = -1
    capture, problems, _ = read(write_exr(tmp_path / "a.exr", pixels))
    assert capture is None
    assert [item.object for item in problems] == [f"Photo '{tmp_path / 'a.exr'}'"]
    assert problems[0].cause == "no pixel of it can be used (75% not finite, 25% below 0)"


def test_a_pixel_of_the_fit_counts_only_if_all_photo_pixels_in_it_do(tmp_path: Path) -> None:
    pixels = plain()
    pixels[5, 7] = np.nan
    capture, _, _ = read(write_exr(tmp_path / "a.exr", pixels), height=HEIGHT // 2)
    assert capture is not None
    expected = np.ones((HEIGHT // 2, WIDTH // 2), bool)
    expected[2, 3] = False
    assert np.array_equal(capture.weight > 0, expected)
    means = plain().reshape(HEIGHT // 2, 2, WIDTH // 2, 2, 3).mean(axis=(1, 3))
    assert np.allclose(capture.reference[expected], means[expected], atol=1e-6)


def test_clipped_pixels_have_no_weight_and_their_share_is_said(tmp_path: Path) -> None:
    codes = np.full((HEIGHT, WIDTH, 3), 120, np.uint8)
    codes[:3, :, 1] = 255
    capture, _, warnings = read(write_png(tmp_path / "a.png", codes))
    assert capture is not None
    assert np.array_equal(capture.weight > 0, codes[..., 1] < 255)
    assert warnings == [
        f"Photo '{tmp_path / 'a.png'}': 25.0% of its pixels are clipped (from green 0.997) "
        "and do not count; give the photo less exposure"
    ]


def test_clipping_counts_within_the_mask_alone(tmp_path: Path) -> None:
    """A bright window beside what is masked is nothing to tell; of a half, twice the share is."""
    codes = np.full((HEIGHT, WIDTH, 3), 120, np.uint8)
    codes[:3, :, 1] = 255
    photo = write_png(tmp_path / "a.png", codes)
    lower = np.zeros((HEIGHT, WIDTH), np.uint8)
    lower[3:] = 255
    assert read(photo, write_png(tmp_path / "lower.png", lower))[2] == []
    upper = np.zeros((HEIGHT, WIDTH), np.uint8)
    upper[:6] = 255
    (said,) = read(photo, write_png(tmp_path / "upper.png", upper))[2]
    assert "50.0% of its pixels are clipped" in said


@pytest.mark.parametrize("rows", [HEIGHT, HEIGHT // 2])
def test_clipping_counts_within_the_silhouette_alone(tmp_path: Path, rows: int) -> None:
    """At any size, and where a lens gives each pixel its outline."""
    codes = np.full((HEIGHT, WIDTH, 3), 120, np.uint8)
    codes[:3, :, 1] = 255
    photo = write_png(tmp_path / "a.png", codes)
    columns = WIDTH * rows // HEIGHT
    within = np.zeros((rows, columns), bool)
    within[: rows // 2] = True
    places = np.stack(
        np.meshgrid(np.linspace(0, WIDTH, columns + 1), np.linspace(0, HEIGHT, rows + 1)), -1
    )
    for corners in (None, places):
        read_small = native.image().read_at_size
        info = read_small(str(photo), columns, rows, within=within, corners=corners)[3]
        assert info["warnings"][0].startswith("50.0% of its pixels are clipped")
        info = read_small(str(photo), columns, rows, within=~within, corners=corners)[3]
        assert info["warnings"] == []
    with pytest.raises(ValueError, match="within has shape"):
        read_small(str(photo), columns, rows, within=within[1:])


def test_clipping_that_is_guessed_names_level_and_cure(tmp_path: Path) -> None:
    """A highlight of floats, cut in green at 0.5; red reaches 0.8 beside it."""
    y, x = np.mgrid[:64, :64]
    light = np.exp(-((x - 30) ** 2 + (y - 34) ** 2) / 200.0)
    image = light[..., None] * np.array([0.8, 0.7, 0.3])
    image[..., 1] = np.minimum(image[..., 1], 0.5)
    path = write_exr(tmp_path / "a.exr", image.astype(np.float32))
    found = native.image().read(path)[2]["warnings"]
    share = (image[..., 1] == 0.5).mean()
    assert found == [
        f"{100 * share:.1f}% of its pixels are clipped (from green 0.5) and do not count; if "
        "nothing is cut off there, let all count: 'clip' [0, 0.801] in the captures or Clip Levels "
        "in the panel"
    ]


def test_a_photo_that_has_not_converged_is_named_with_share_effect_and_cure(tmp_path: Path) -> None:
    random = np.random.default_rng(0)
    pixels = np.full((48, 64, 3), 0.2, np.float32)
    clean, problems, warnings = read(write_exr(tmp_path / "a.exr", pixels), size=(64, 48))
    assert clean is not None and clean.isolated == 0 and not problems and not warnings
    pixels[random.random((48, 64)) < 0.02] = 5
    noisy, problems, warnings = read(write_exr(tmp_path / "b.exr", pixels), size=(64, 48))
    assert noisy is not None and not problems
    assert 0.1 < noisy.isolated < 0.4
    (text,) = warnings
    assert f"{100 * noisy.isolated:.1f}% of its light is in " in text and "b.exr" in text
    assert "wrong by more than their intervals say" in text and "more samples" in text
    assert noisy.warnings == (text,)


def test_a_mask_is_read_by_the_same_rules(tmp_path: Path) -> None:
    photo = write_exr(tmp_path / "a.exr", plain())
    values = np.ones((HEIGHT, WIDTH))
    values[0, 0] = np.nan
    values[1, :2] = -1
    values[4, 0] = 0.25
    mask = write_exr(tmp_path / "mask.exr", values)
    capture, problems, warnings = read(photo, mask)
    assert not problems
    assert capture is not None
    expected = values.copy()
    expected[:3, :3] = 0  # they and the rim around them
    assert np.allclose(capture.weight, expected, atol=1e-4)
    title = f"Mask '{mask}'"
    assert warnings == [
        f"{title}: 1 of its pixels is not finite (NaN or infinite) and left out",
        f"{title}: 2 of its pixels are below 0 and left out",
    ]


def test_a_mask_keeps_its_stored_values_whatever_its_colours_are(tmp_path: Path) -> None:
    photo = write_exr(tmp_path / "a.exr", plain())
    codes = np.full((HEIGHT, WIDTH), 51, np.uint8)
    mask = write_png(tmp_path / "mask.png", codes, (b"gAMA", struct.pack(">I", 100000)))
    capture, _, warnings = read(photo, mask)
    assert capture is not None
    assert not warnings
    assert np.allclose(capture.weight, 0.2, atol=1e-4)


def test_a_white_mask_is_not_clipped(tmp_path: Path) -> None:
    photo = write_exr(tmp_path / "a.exr", plain())
    mask = write_png(tmp_path / "mask.png", np.full((HEIGHT, WIDTH), 255, np.uint8))
    capture, _, warnings = read(photo, mask)
    assert capture is not None
    assert not warnings
    assert (capture.weight == 1).all()


@pytest.mark.parametrize("which", ["photo", "mask"])
def test_what_is_refused_names_the_file_the_cause_and_the_cure(which: str, tmp_path: Path) -> None:
    busy = np.random.default_rng(1).integers(1, 250, (HEIGHT, WIDTH, 3)).astype(np.uint8)
    good = write_png(tmp_path / "good.png", busy)
    bad = tmp_path / "bad.png"
    bad.write_bytes(good.read_bytes()[:300])
    photo, mask = (bad, None) if which == "photo" else (good, bad)
    capture, problems, _ = read(photo, mask)
    assert capture is None
    (problem,) = problems
    assert problem.object == f"{which.capitalize()} '{bad}'"
    assert problem.cause.startswith("cannot be read: it ")
    assert problem.cure == "copy or export it again"
    assert str(bad) not in problem.cause + problem.cure


def test_a_mask_of_another_size_is_a_problem(tmp_path: Path) -> None:
    photo = write_exr(tmp_path / "a.exr", plain())
    mask = write_png(tmp_path / "mask.png", np.full((4, 4), 255, np.uint8))
    _, problems, _ = read(photo, mask)
    assert [item.object for item in problems] == [f"Mask '{mask}'"]
    assert "4 x 4 pixels, its photo 16 x 12" in problems[0].cause


def test_colours_are_converted_as_the_file_says(tmp_path: Path) -> None:
    truth = plain()
    gamma = write_png(
        tmp_path / "gamma.png",
        np.rint(truth ** (1 / 1.8) * 65535).astype(np.uint16),
        (b"gAMA", struct.pack(">I", round(100000 / 1.8))),
    )
    capture, _, warnings = read(gamma)
    assert capture is not None
    assert not warnings
    assert np.allclose(capture.reference, truth, atol=1e-4)
    # ITU-R BT.2087, table of linear Rec. 709 to Rec. 2020
    wide = np.array([[0.6274, 0.3293, 0.0433], [0.0691, 0.9195, 0.0114], [0.0164, 0.0880, 0.8956]])
    rec2020 = (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290)
    capture, _, _ = read(write_exr(tmp_path / "a.exr", truth @ wide.T, chromaticities=rec2020))
    assert capture is not None
    assert np.allclose(capture.reference, truth, atol=1e-3)


def test_a_size_that_memory_could_not_hold_is_refused_before_it_is_asked_for(
    tmp_path: Path,
) -> None:
    path = write_png(tmp_path / "a.png", np.full((HEIGHT, WIDTH, 3), 99, np.uint8))
    data = bytearray(path.read_bytes())
    data[16:24] = struct.pack(">II", 99999, 99999)
    data[29:33] = struct.pack(">I", zlib.crc32(bytes(data[12:29])))
    path.write_bytes(bytes(data))
    _, problems, _ = read(path, size=(99999, 99999))
    assert "it says it has 99999 x 99999 pixels" in problems[0].cause
    assert "200 megapixels" in problems[0].cure


def test_a_packed_photo_whose_copy_does_not_fit_on_the_disk_is_a_problem(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(_name: str, _packed: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    picture = write_png(tmp_path / "a.png", np.full((HEIGHT, WIDTH, 3), 128, np.uint8))
    packed = {"packed:a": picture.read_bytes()}
    aspect = WIDTH / HEIGHT
    camera = SimpleNamespace(name="Camera", width=WIDTH, height=HEIGHT, aspect=aspect, lens=None)
    scene = SimpleNamespace(cameras=[camera], unusable_cameras={})
    request = CaptureRequest("Camera", "packed:a")
    problems: list[Problem] = []
    assert read_captures(scene, [request], HEIGHT, problems, [], packed) and not problems
    monkeypatch.setattr(prepared, "as_file", full)
    assert read_captures(scene, [request], HEIGHT, problems, [], packed) == []
    (problem,) = problems
    assert problem.object == "Photo 'packed:a'"
    assert "No space left on device" in problem.cause
