# SPDX-License-Identifier: GPL-3.0-or-later
"""A run in stages: some parameters first, others later."""
