# SPDX-License-Identifier: GPL-3.0-or-later
"""How a reading goes on: in render mode, step by step, without words."""
