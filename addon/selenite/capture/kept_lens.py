# SPDX-License-Identifier: GPL-3.0-or-later
"""The lens that an import has kept with a camera, for photos that say nothing of one themselves."""

from __future__ import annotations

from dataclasses import replace

from ..problems import listed
from ..scene_read.values import CameraValues
from .photo_files import same_aspect
from .request import CaptureRequest

_MOST_NAMED = 5


class KeptLenses:
    """Gives photos the lens of their camera, and remembers of which cameras."""

    def __init__(self) -> None:
        self._undone: dict[str, None] = {}
        self._other_shape: dict[str, None] = {}

    def given_to(
        self, request: CaptureRequest, camera: CameraValues, file_size: tuple[int, int]
    ) -> CaptureRequest:
        """The same where the camera has none, or the request says what the lens does. The lens is
        that of the photo's size, whatever that of the calibration is."""
        kept = camera.lens
        if kept is None or request.distortion is not None or camera.kind == "ORTHO":
            return request
        if request.size is None and request.crop is not None:  # a problem of its own
            return request
        size = request.size or file_size
        if not same_aspect(size, kept.size):
            if kept.lens.distorts:
                self._other_shape[camera.name] = None
            return request
        lens = kept.lens.at_scale(size[0] / kept.size[0], size[1] / kept.size[1])
        found = replace(request, size=size)
        if request.pixel_aspect is None:
            found = replace(found, pixel_aspect=lens.fy / lens.fx)
        if lens.distorts:
            self._undone[camera.name] = None
            found = replace(found, distortion=lens)
        return found

    def remarks(self) -> list[str]:
        """One for all photos that got a lens, and one for those whose shape is another."""
        found = []
        if self._undone:
            found.append(
                f"Lens of {_some(self._undone)}, kept by the import: its distortion is undone in "
                "the photos; where they are free of it, give --undistorted, 'distortion': "
                "false in the captures, or Undistorted in the panel"
            )
        if self._other_shape:
            found.append(
                f"Lens of {_some(self._other_shape)}, kept by the import: the photos have another "
                "shape than its calibration, so its distortion is not undone"
            )
        return found


def _some(names: dict[str, None]) -> str:
    more = len(names) - _MOST_NAMED
    return listed([*names][:_MOST_NAMED]) + (f" and {more} more" if more > 0 else "")
