# SPDX-License-Identifier: GPL-3.0-or-later
"""Node trees: materials, textures, media, the world."""
