# SPDX-License-Identifier: GPL-3.0-or-later
"""The result of a fit: in short, and in full."""
