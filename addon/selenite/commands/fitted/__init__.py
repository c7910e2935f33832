# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands about a fit that has ended: judged by other photos, or begun at."""
