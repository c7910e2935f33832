# SPDX-License-Identifier: GPL-3.0-or-later
"""bpy in, numbers out: reads a Blender scene into values and builds the native scene from them."""
