# SPDX-License-Identifier: Apache-2.0
"""The benchmarks can be taken: their programs are built and run, whatever they measure."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_groups_are_taken_and_told(tmp_path: Path) -> None:
    groups = ["dispatch", "reader", "transition", "plan", "verb", "remote"]
    command = [sys.executable, ROOT / "bench" / "run.py", "--quick", "--json", tmp_path / "bench.json"]
    done = subprocess.run(
        [*command, *(word for group in groups for word in ("--only", group))],
        capture_output=True,
        text=True,
        env={**os.environ, "OPENGPAC_BENCH_PROFILE": "checked"},
    )
    assert done.returncode == 0, done.stdout + done.stderr
    taken = json.loads((tmp_path / "bench.json").read_text())["lines"]
    assert len({line["row"] for line in taken if line["value"] is not None}) == len(groups)
    assert "bars hold" in done.stdout
