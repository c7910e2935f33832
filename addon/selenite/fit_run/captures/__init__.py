# SPDX-License-Identifier: GPL-3.0-or-later
"""Photos of a fit: what was photographed under which lights, and its render."""
