# SPDX-License-Identifier: GPL-3.0-or-later
"""pytest in a process that ends at once afterwards: Blender as a module can hang on the way out."""

import os
import sys

import pytest

status = pytest.main(sys.argv[1:])
sys.stdout.flush()
sys.stderr.flush()
os._exit(int(status))
