# SPDX-License-Identifier: GPL-3.0-or-later
"""What a fit has found: the result folder, its table and pictures, the scene at it."""
