# SPDX-License-Identifier: GPL-3.0-or-later
"""What to photograph next, what photos determine, and what precision costs."""
