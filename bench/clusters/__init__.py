# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps of a fit by the workers of a cluster."""
