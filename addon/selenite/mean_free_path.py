# SPDX-License-Identifier: GPL-3.0-or-later
"""How far light goes in a medium before it meets it: 1 / extinction, as a length."""

from __future__ import annotations

from dataclasses import dataclass

from .parameters import Values


@dataclass(frozen=True)
class MeanFreePath:
    """Per channel, None where nothing is met (extinction 0); `unit`: "mm" or "Blender unit"."""

    value: tuple[float | None, ...]
    unit: str

    def text(self) -> str:
        """ "0.5 mm", or "0.5, 2, endless mm" where the channels differ."""
        parts = ["endless" if length is None else f"{length:.3g}" for length in self.value]
        numbers = parts[0] if len(set(parts)) == 1 else ", ".join(parts)
        return numbers if numbers == "endless" else f"{numbers} {self.unit}"

    def as_json(self) -> dict[str, object]:
        """Keys value, a list with null where nothing is met, and unit."""
        return {"value": list(self.value), "unit": self.unit}


def of(extinction: Values, millimetres: float | None) -> MeanFreePath:
    """Of an extinction in 1 / Blender unit.

    millimetres: in one Blender unit (the scene's unit scale; Cycles ignores it, so it only
    translates lengths); None where the scene has no system of units.
    """
    scale = 1.0 if millimetres is None else millimetres
    lengths = tuple(scale / sigma if sigma > 0 else None for sigma in extinction)
    return MeanFreePath(lengths, "Blender unit" if millimetres is None else "mm")
