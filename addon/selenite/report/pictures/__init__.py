# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of a fit, drawn with numpy alone: comparisons with photos, plots, contact sheet."""
