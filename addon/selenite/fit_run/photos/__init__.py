# SPDX-License-Identifier: GPL-3.0-or-later
"""Photos: from a file and how it was taken to linear light of the working size with weights."""
