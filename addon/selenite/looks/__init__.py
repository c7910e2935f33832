# SPDX-License-Identifier: GPL-3.0-or-later
"""Looks at fixed values: what photos, and places without one, say about the unknowns of a fit."""
