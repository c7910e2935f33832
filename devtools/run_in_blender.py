# SPDX-License-Identifier: GPL-3.0-or-later
"""pytest inside a Blender executable: blender -b --python run_in_blender.py -- PYTEST ARGUMENTS

Blender's own packages come first (numpy above all); what it lacks, pytest among it, is taken from
the checkout's environment.
"""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "addon"))
sys.path.append(str(ROOT / ".venv/lib/python3.11/site-packages"))
# Debian's modules, for one of them is OpenVDB's: with ours on the PATH Blender does not find them.
sys.path.append("/usr/lib/python3/dist-packages")

import pytest  # noqa: E402

status = int(pytest.main(sys.argv[sys.argv.index("--") + 1 :]))
sys.stdout.flush()
sys.stderr.flush()
sys.exit(status)
