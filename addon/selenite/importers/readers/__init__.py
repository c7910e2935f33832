# SPDX-License-Identifier: GPL-3.0-or-later
"""A reader for each format of a reconstruction. None of them knows Blender."""
