# SPDX-License-Identifier: Apache-2.0
"""What the figure scripts in the neighbouring folder `plots` offer."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "plots"))
from run_data import InputError, Run, milliseconds, plt, run_script  # noqa: E402, F401  (needs the path)
