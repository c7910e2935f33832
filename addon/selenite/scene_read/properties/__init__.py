# SPDX-License-Identifier: GPL-3.0-or-later
"""One table of every property of Blender that could change a picture by Cycles, and its class.

A property is modelled, has no effect on radiance, is refused, or is warned of. `judge` names each
value of a scene that the renderer does not take as it is, with object, cause and cure. What the
table does not know, because Blender is newer than it, is named too if it is not at its default.
"""

from .conditions import Scope
from .judge import Finding, instancers_of, judge
from .tables import TABLES

__all__ = ["TABLES", "Finding", "Scope", "instancers_of", "judge"]
