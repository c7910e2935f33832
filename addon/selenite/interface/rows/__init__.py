# SPDX-License-Identifier: GPL-3.0-or-later
"""The list of parameters: groups, labels, order, and what it says of the active one."""
