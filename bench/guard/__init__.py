# SPDX-License-Identifier: GPL-3.0-or-later
"""What `./dev bench guard` measures and compares."""
