# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles as the judge of a fit: its render settings, its pictures, their difference from ours."""
