# SPDX-License-Identifier: Apache-2.0
"""The benchmarks are runnable: their programs are built and run, whatever they measure."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("group", ["dispatch", "reader", "transition", "plan", "verb", "remote", "queue"])
def test_a_group_is_taken_and_told(group: str, tmp_path: Path) -> None:
    command = [sys.executable, ROOT / "bench" / "run.py", "--quick", "--json", tmp_path / "bench.json", "--only", group]
    done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "OPENGPAC_BENCH_PROFILE": "checked"})
    assert done.returncode == 0, done.stdout + done.stderr
    taken = json.loads((tmp_path / "bench.json").read_text())["lines"]
    assert len({line["row"] for line in taken if line["value"] is not None}) == 1
    assert "bars hold" in done.stdout
