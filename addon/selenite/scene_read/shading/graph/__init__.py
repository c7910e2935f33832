# SPDX-License-Identifier: GPL-3.0-or-later
"""Node trees as programs: a file for each family of nodes."""
