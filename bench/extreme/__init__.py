# SPDX-License-Identifier: GPL-3.0-or-later
"""Ends of every range: scenes whose light is known on paper, and derivatives against pictures."""
