# SPDX-License-Identifier: GPL-3.0-or-later
"""What is wrong with a request, in Blender's reports."""

from __future__ import annotations

import bpy

from ..problems import BadInput


def report_problems(operator: bpy.types.Operator, error: BadInput) -> None:
    """Every problem becomes one line of Blender's report."""
    operator.report({"ERROR"}, "\n".join(problem.line() for problem in error.problems))
