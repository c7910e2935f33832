# SPDX-License-Identifier: GPL-3.0-or-later
"""Reconstructions of other programs: readers without Blender, and what turns them into objects."""
