# SPDX-License-Identifier: GPL-3.0-or-later
"""A fit from request to result folder; no bpy here."""
