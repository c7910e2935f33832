# SPDX-License-Identifier: GPL-3.0-or-later
"""Images of a material's parameters as unknowns."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ... import native, parameters
from ...parameters import Values
from ...paths import file_stems
from ...problems import BadInput, Problem, Reason, listed
from ...scene_read.values import MapValues, Owner, SceneValues, TextureValues, greyed
from ..field_kinds import Family, field_kind
from ..request import UnknownRequest
from ..settings import FitSettings
from .base import (
    ONE_START,
    is_share,
    material_of,
    means,
    picture_of,
    rate_of,
    share_bounds,
    whole_number,
)
from .seen import SurfaceUnknown, unseen_of, usual_coverage

if TYPE_CHECKING:
    from ..._core import Scene

#: Texels along each side where the request names none, and at most.
USUAL_TEXELS, MOST_TEXELS = 256, 8192


@dataclass(frozen=True, eq=False)
class ImageUnknown(SurfaceUnknown):
    """`start`: the map of the parameter, its texels as the image holds them; where it gives a
    number,
    grey and linear."""

    start: MapValues

    @property
    def channels(self) -> int:
        """Numbers of a texel."""
        return self.kind.channels

    @property
    def is_light(self) -> bool:
        """Whether its texels reflect or emit more where they are larger: colours of a parameter."""
        return self.channels > 1 and self.kind.family is Family.IMAGE

    @property
    def file_stem(self) -> str:
        """Of its files' names."""
        return f"{self.stem}_{self.kind.use}"

    @property
    def texture(self) -> TextureValues:
        """The image at the start."""
        assert self.start.texture is not None  # noqa: S101 - made by `image_unknown`
        return self.start.texture

    @property
    def values(self) -> np.ndarray:
        """(h, w, 3), or (h, w, 1) of a number, row 0 at the top."""
        return self.texture.pixels[..., : self.channels]

    def starting_at(self, values: np.ndarray) -> ImageUnknown:
        """This image with another start."""
        pixels = np.ascontiguousarray(np.broadcast_to(values, (*values.shape[:2], 3)))
        return replace(
            self, start=replace(self.start, texture=replace(self.texture, pixels=pixels))
        )

    def in_scene(self, scene: SceneValues) -> SceneValues:
        """The scene with the start in it."""
        materials = [
            replace(item, maps=item.maps | {self.kind.use: self.start})
            if item.name == self.owner
            else item
            for item in scene.materials
        ]
        return replace(scene, materials=materials)

    def placed(self, scene: Scene, values: np.ndarray) -> Scene:
        """The native scene, which has the image, with other texels in it."""
        return scene.with_image(self.owner, values, self.kind.parameter)

    def stored(self, colour: Values) -> np.ndarray:
        """In sRGB where the image is."""
        return stored_colour(colour, self.texture.encoded)

    def completed(self, values: np.ndarray, known: np.ndarray) -> np.ndarray:
        """Filled smoothly from the nearest texels that are known."""
        return inpainted(values, known)

    def mean(self, values: np.ndarray) -> Values:
        """Of the linear colours."""
        return means(native.image().srgb_decode(values) if self.texture.encoded else values)

    @property
    def files(self) -> list[str]:
        """The image, and a picture of what the photos see of it."""
        stem, is_png = self.file_stem, self.texture.encoded or self.channels == 1
        return [f"{stem}{'.png' if is_png else '.exr'}", f"{stem}_coverage.png"]

    def write(self, folder: Path, values: np.ndarray, coverage: np.ndarray | None) -> None:
        """An sRGB image, and numbers as they are, as PNG of 16 bits; any other as EXR. Raises
        OSError."""
        image, seen = (str(folder / name) for name in self.files)
        if image.endswith(".png"):
            pixels = np.broadcast_to(values, (*values.shape[:2], 3)).astype(np.float32)
            native.image().write_png(image, native.image().srgb_decode(pixels), bit_depth=16)
        else:
            native.image().write_exr(image, np.ascontiguousarray(values))
        if coverage is not None:
            usual = usual_coverage(coverage)
            grey = np.clip(coverage / (2 * usual), 0, 1) if usual > 0 else coverage
            native.image().write_png(seen, native.image().srgb_decode(grey.astype(np.float32)))

    def about(self, values: np.ndarray, coverage: np.ndarray | None) -> dict[str, object]:
        """Texels across and down, the share of them that the photos see, and the files."""
        files = self.files if coverage is not None else self.files[:1]
        size = [int(n) for n in values.shape[1::-1]]
        return {"texels": size, **self.share_seen(coverage), "files": files}


def image_unknown(
    scene: SceneValues, request: UnknownRequest, settings: FitSettings, title: str
) -> ImageUnknown:
    """The image that a request asks for, with its start. Raises BadInput."""
    kind = field_kind(request.parameter)
    owner = material_of(scene, request, title)
    low, high = share_bounds(request, title)
    rate = rate_of(request, settings, title)
    start = _start(scene, owner, request, title)
    assert start.texture is not None  # noqa: S101 - `_start` gives one
    texture = start.texture if kind.channels > 1 else numbers_of(start.texture)
    pixels = texture.pixels  # large ones are not copied without need
    if pixels.min() < np.float32(low) or pixels.max() > np.float32(high):
        pixels = np.clip(pixels, np.float32(low), np.float32(high))
    material = next(item for item in scene.materials if item.name == owner.name)
    of_scene = kind.use in material.maps and not request.grid and request.start is None
    of_file = bool(request.grid) and not request.grid.isdecimal()
    filled = replace(
        request,
        owner=owner.name,
        minimum=low,
        maximum=high,
        learning_rate=rate,
        unseen=unseen_of(request, of_scene or of_file, title),
    )
    return ImageUnknown(
        owner.name, kind, low, high, rate, 1.0, filled, file_stems(scene.owners)[owner.name],
        filled.unseen, replace(start, texture=replace(texture, pixels=pixels)),
    )  # fmt: skip


def inpainted(values: np.ndarray, known: np.ndarray) -> np.ndarray:
    """(h, w, 3) with those that are not known (h, w) filled smoothly from the nearest that are.

    Source: Gortler et al. 1996, "The Lumigraph", section 3.4: means of ever coarser levels, pulled
    up, pushed down into the holes.
    """
    if not known.any():
        return values
    weight = known.astype(np.float64)[..., None]
    levels = [(values * weight, weight)]
    while max(levels[-1][1].shape[:2]) > 1:
        sums, weights = levels[-1]
        # Weights saturate, so that one known texel counts as much as many.
        levels.append((_halved(sums), _halved(weights)))
        total = levels[-1][1]
        levels[-1] = (levels[-1][0] / np.maximum(total, 1), np.minimum(total, 1))
    sums, weights = levels.pop()
    filled = sums / weights
    for sums, weights in reversed(levels):
        height, width = weights.shape[:2]
        coarse = filled.repeat(2, axis=0).repeat(2, axis=1)[:height, :width]
        filled = sums + (1 - weights) * coarse
    return np.where(known[..., None], values, filled).astype(np.float32)


def _halved(values: np.ndarray) -> np.ndarray:
    """Sums over squares of 2 x 2; an odd edge stands alone."""
    height, width = values.shape[:2]
    padded = np.pad(values, ((0, height % 2), (0, width % 2), (0, 0)))
    return padded.reshape((height + 1) // 2, 2, (width + 1) // 2, 2, -1).sum(axis=(1, 3))


def numbers_of(texture: TextureValues) -> TextureValues:
    """The image with the numbers that a socket takes of it, linear, in all channels."""
    pixels = texture.pixels
    linear = native.image().srgb_decode(pixels) if texture.encoded else pixels
    is_grey = bool((linear == linear[..., :1]).all())
    return replace(
        texture, encoded=False, pixels=linear if is_grey else greyed(linear, "luminance")
    )


def _start(scene: SceneValues, owner: Owner, request: UnknownRequest, title: str) -> MapValues:
    """From a file, from the scene, or one colour in as many texels as asked for."""
    kind = field_kind(request.parameter)
    words = kind.use.replace("_", " ").replace("color", "colour")
    material = next(item for item in scene.materials if item.name == owner.name)
    own = material.maps.get(kind.use)
    if own is not None and own.grey and kind.channels > 1:
        label = parameters.table()["material", kind.use].sockets[0]
        cause = f"a socket on the way to the {label} makes its colours grey"
        raise BadInput(Problem(title, cause, "link it through sockets of colours only"))
    if own is not None and own.texture is None:
        cause = f"its {words} comes from the colour attribute '{own.attribute}'"
        raise BadInput(Problem(title, cause, "unlink it, or link an image"))
    constant = material.values.get(kind.use)
    fixed = owner.fixed.get(kind.use, Reason())
    if own is None and (constant is None or kind.use not in owner.values or fixed):
        reason = fixed or Reason(f"its {words} could not be read")
        raise BadInput(reason.problem(title, f"give it a Principled BSDF with a {words}"))
    _check_use(scene, owner, title)
    fill = fill_of(request, title)
    is_colour = kind.channels > 1
    start = own or MapValues(TextureValues("", np.empty(0), is_colour, "REPEAT", "Linear"), "")
    texture = start.texture
    assert texture is not None  # noqa: S101 - see above
    if own is not None and texture.pixels.shape[2] == 4:
        cause = f"image '{texture.name}' has alpha"
        cure = "set the image's Alpha to None or Channel Packed"
        raise BadInput(Problem(title, cause, cure))
    if request.grid and not request.grid.isdecimal():
        if fill is not None:
            raise BadInput(Problem(title, "it has two starts", ONE_START))
        return replace(start, texture=from_file(request.grid, texture, title))
    if own is not None and not request.grid:
        if fill is None:
            return own
        shape = texture.pixels.shape
    else:
        number = whole_number(request.grid, USUAL_TEXELS)
        if not 1 <= number <= MOST_TEXELS:
            cause = f"its image has {number} texels along each side"
            raise BadInput(Problem(title, cause, f"give 1 to {MOST_TEXELS}, or a file"))
        shape = (number, number, 3)
    colour = fill or constant
    assert colour is not None  # noqa: S101 - see above
    pixels = np.empty(shape, np.float32)
    pixels[:] = stored_colour(colour, texture.encoded)
    name = texture.name or f"{owner.name} {kind.use}"
    return replace(start, texture=replace(texture, name=name, pixels=pixels))


def fill_of(request: UnknownRequest, title: str) -> Values | None:
    """One value at all texels, where a request has one. Raises BadInput."""
    fill = request.start
    if fill is not None and not is_share(fill):
        cause = f"its start is {', '.join(f'{x:g}' for x in fill)}"
        raise BadInput(Problem(title, cause, "give 1 or 3 numbers in [0, 1]"))
    return fill


def _check_use(scene: SceneValues, owner: Owner, title: str) -> None:
    """What keeps texels from being fitted, beside the image itself. Raises BadInput."""
    used = [item for item in scene.objects if owner.name in item.materials]
    bare = [item.name for item in used if not scene.meshes[item.mesh].uv_maps]
    if bare:
        cause = f"{listed(bare)} has no UV map" if len(bare) == 1 else f"{listed(bare)} have none"
        raise BadInput(Problem(title, cause, "unwrap the mesh (UV > Smart UV Project)"))


def from_file(path: str, like: TextureValues, title: str) -> TextureValues:
    """A picture in place of another: floats are linear, all else is sRGB."""
    pixels, floats = picture_of(path, title)
    stored = pixels if floats else native.image().srgb_encode(pixels)
    return replace(like, name=Path(path).name, pixels=stored, encoded=not floats)


def stored_colour(colour: Values, encoded: bool) -> np.ndarray:
    numbers = np.asarray(colour, np.float32)
    return native.image().srgb_encode(numbers) if encoded else numbers
