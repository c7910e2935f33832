# SPDX-License-Identifier: GPL-3.0-or-later
"""Outputs of nodes that are not read, baked into images by Cycles."""
