# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits whose truth is known: scenes, random targets and starts, and what is said about them."""
