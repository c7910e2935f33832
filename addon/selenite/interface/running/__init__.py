# SPDX-License-Identifier: GPL-3.0-or-later
"""A run in threads: its work, and its files on disk."""
