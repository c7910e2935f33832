# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench golden`: small fits by two revisions, compared bit by bit."""
