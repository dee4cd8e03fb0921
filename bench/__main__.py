# SPDX-License-Identifier: Apache-2.0
"""Starts hotpath_report: `python3 -I -B bench COMMAND`. Isolated (-I), Python imports from this
folder and its own installation only: nothing in the current folder or in PYTHONPATH is executed."""

import sys

from hotpath_report.__main__ import main

sys.exit(main())
