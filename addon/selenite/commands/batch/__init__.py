# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite batch`: many fits, each in a process of its own, and one table of their results."""
