# SPDX-License-Identifier: GPL-3.0-or-later
"""pytest in a process that ends at once afterwards: Blender as a module can hang on the way out."""

import sys

import pytest

from selenite.process_end import end_process

if __name__ == "__main__":  # processes that tests start import this file as well
    status = pytest.main(sys.argv[1:])
    sys.stdout.flush()
    sys.stderr.flush()
    end_process(int(status))
