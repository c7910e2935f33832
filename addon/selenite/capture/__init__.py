# SPDX-License-Identifier: GPL-3.0-or-later
"""Captures: what was photographed, how and under which lights, up to weighted linear pixels."""
