# SPDX-License-Identifier: GPL-3.0-or-later
"""The trade of time against error, measured on the user's own scene."""
