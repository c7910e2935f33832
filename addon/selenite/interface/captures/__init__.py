# SPDX-License-Identifier: GPL-3.0-or-later
"""The list of photos: what a row holds, and what fills it."""
