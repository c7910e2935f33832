# SPDX-License-Identifier: GPL-3.0-or-later
"""One colour in place of an image of the scene, where a stage fits it before a new image."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ... import native, parameters
from ...scene_read.values import MaterialValues, SceneValues
from ..field_kinds import field_kind
from ..request import UnknownRequest
from .request import StageRequest

_IMAGE = "base_color_texture"
_COLOUR = field_kind(_IMAGE).single


def with_colours(
    values: SceneValues,
    requests: Sequence[UnknownRequest],
    stages: Sequence[StageRequest],
    warnings: list[str],
) -> SceneValues:
    """The scene whose base colour is the mean of its image, as that of an imported mesh, where both
    the colour and an image are fitted and a stage has the colour alone: the light is found with one
    colour then, and the new image starts there. The same where nothing of this holds."""
    asked = {(item.owner, item.parameter) for item in requests}
    for material in values.materials:
        names = [parameters.join_name(material.name, name) for name in (_COLOUR, _IMAGE)]
        both = {(material.name, _COLOUR), (material.name, _IMAGE)} <= asked
        alone = any(
            names[0] in item.parameters and names[1] not in item.parameters for item in stages
        )
        found = material.maps.get(_COLOUR)
        if both and alone and found is not None and found.texture is not None:
            values = _freed(values, material)
            warnings.append(
                f"Parameter '{names[1]}': the image of the scene gives way to a new one, which "
                "starts at the colour that is fitted before it"
            )
    return values


def _freed(values: SceneValues, material: MaterialValues) -> SceneValues:
    texture = material.maps[_COLOUR].texture
    assert texture is not None  # noqa: S101 - see `with_colours`
    pixels = np.ascontiguousarray(texture.pixels[..., :3], np.float32)
    linear = native.image().srgb_decode(pixels) if texture.encoded else pixels
    colour = tuple(float(x) for x in np.clip(linear.reshape(-1, 3).mean(axis=0, dtype=float), 0, 1))
    maps = {name: item for name, item in material.maps.items() if name != _COLOUR}
    plain = replace(material, maps=maps, values=material.values | {_COLOUR: colour})
    owner = values.owners[material.name]
    fixed = {name: why for name, why in owner.fixed.items() if name != _COLOUR}
    freed = replace(owner, fixed=fixed, values=owner.values | {_COLOUR: colour})
    return replace(
        values,
        materials=[plain if item.name == material.name else item for item in values.materials],
        owners=values.owners | {material.name: freed},
    )
