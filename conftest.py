# SPDX-License-Identifier: Apache-2.0
"""Plugins of every test run in this tree: `pytest -n 4` runs tests side by side (tests/running/side_by_side.py)."""

import os

# Read when NumPy is loaded, here and in each program that a test starts: unneeded threads take a quarter of that time.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

pytest_plugins = ["side_by_side"]
