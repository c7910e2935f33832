# SPDX-License-Identifier: GPL-3.0-or-later
"""German texts of the interface."""

GERMAN = {
    "Start Fit": "Anpassung starten",
}
