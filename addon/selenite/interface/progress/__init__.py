# SPDX-License-Identifier: GPL-3.0-or-later
"""How far work has come: the head of the tab, bars, and the notice at the end."""
