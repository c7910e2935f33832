# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps: their light, and where they stand in each photo."""
