# SPDX-License-Identifier: GPL-3.0-or-later
"""What goes wrong before and during a fit, in plain words."""
