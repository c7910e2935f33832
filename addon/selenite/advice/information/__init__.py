# SPDX-License-Identifier: GPL-3.0-or-later
"""Fisher information at fixed values: what photos say about the unknowns of a fit."""
