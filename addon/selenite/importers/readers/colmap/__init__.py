# SPDX-License-Identifier: GPL-3.0-or-later
"""COLMAP: its models, in text and binary."""
