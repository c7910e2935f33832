# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench cluster`: what workers cost and bring in a step of a fit.

The demo scene with photos of our own. Measures a step in one process, with one worker and with two
(a core each), and the times of its parts in one process: of each picture, and of what the fit does
with it. From these parts and the pace of one worker it predicts a step for one to 256 workers with
modelled links. Status 1 where one worker costs more than the limit, or the prediction for two is
off by more.
"""

import sys
from pathlib import Path

if __name__ == "__main__":  # workers of this machine import this file as well
    ROOT = Path(__file__).resolve().parent.parent
    sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "bench"), str(ROOT / "scenes")]
    from clusters.steps import main

    sys.exit(main(__doc__))
