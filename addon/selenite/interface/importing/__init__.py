# SPDX-License-Identifier: GPL-3.0-or-later
"""Reconstructions from files, and what mends them."""
