# SPDX-License-Identifier: GPL-3.0-or-later
"""Small faults as data, and what it takes to see whether the tests notice them."""
