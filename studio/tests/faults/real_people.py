# SPDX-License-Identifier: Apache-2.0
"""The example with an operator's panel on the real clock: what the page starts moves at once, or never."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[3] / "examples" / "operator_panel"))

import program

cell = program.make("monotonic")
