# SPDX-License-Identifier: GPL-3.0-or-later
"""Light from all directions as an image: sizes, frames, photos of mirror balls, bright spots."""
