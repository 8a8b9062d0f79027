# SPDX-License-Identifier: Apache-2.0
"""Attacks on floating-point state, in a process of their own: an attack that escapes detection makes a process check each of its blocks
permanently."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path


def test_attacks_in_a_process_of_their_own() -> None:
    attacks = Path(__file__).with_name("attacks_on_floats.py")
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", attacks]
    surroundings = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")}
    ran = subprocess.run(command, capture_output=True, text=True, env=surroundings)
    assert ran.returncode == 0, ran.stdout[-6000:] + ran.stderr[-2000:]
    assert "passed" in ran.stdout
