# SPDX-License-Identifier: GPL-3.0-or-later
"""A run as the user sees it: its work in threads, its head in the panel, its end."""
