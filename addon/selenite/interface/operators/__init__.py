# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user starts: each reads the panel's settings and leaves its result in the state."""
