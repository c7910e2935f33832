# SPDX-License-Identifier: GPL-3.0-or-later
"""`python -m selenite` is the command line."""

from .cli import main

main()
