# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the next photo should be taken from: what each place would add to what the photos say."""
