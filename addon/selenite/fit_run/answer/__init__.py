# SPDX-License-Identifier: GPL-3.0-or-later
"""What a fit answers: the result folder, its findings, the scene at it."""
