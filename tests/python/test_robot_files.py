# SPDX-License-Identifier: Apache-2.0
"""Robot files of other people, as they are: twelve of those of `make robots`, and what docs/robots.md says of all."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tomllib
from importlib import metadata
from pathlib import Path

import pytest

TOP = Path(__file__).parents[2]
PACKAGES = tomllib.loads((TOP / "tests/robots/files.toml").read_text())
FILES = [
    ("gymnasium", "reacher.xml", 2),
    ("airo-models", "arms/ur3e/ur3e.urdf", 6),
    ("airo-models", "grippers/robotiq_2f_85/urdf/robotiq_2f_85.urdf", 1),
    ("airo-models", "grippers/schunk_egk40/urdf/schunk_egk40.urdf", 2),
    ("rtb-data", "abb_irb140_description/urdf/irb140.urdf", 6),
    ("rtb-data", "kuka_description/kuka_lbr_iiwa/urdf/lbr_iiwa_14_r820.urdf", 7),
    ("rtb-data", "kuka_description/kuka_kr210/urdf/kr210l150.urdf", 6),
    ("example-robot-data", "so_arm_description/urdf/so101.urdf", 6),
    ("example-robot-data", "ur_description/urdf/ur5_gripper.urdf", 6),
    ("example-robot-data", "finger_edu_description/robots/finger_edu.urdf", 3),
    ("example-robot-data", "double_pendulum_description/urdf/double_pendulum.urdf", 2),
    ("example-robot-data", "asr_twodof_description/urdf/TwoDofs.urdf", 2),
]
"""Files of the table whose packages the tests have, with their joints."""
PAGE = (TOP / "docs/robots.md").read_text().partition("\n## Files\n")[2]


@pytest.mark.parametrize(("package", "file", "joints"), FILES, ids=[file.rpartition("/")[2] for _, file, _ in FILES])
def test_a_file_of_others_loads_holds_still_and_every_joint_arrives(package: str, file: str, joints: int, tmp_path: Path) -> None:
    """Held for 2 s, each joint moved by a tenth of its range and back, then all at once, under gravity."""
    assert file in PACKAGES[package]["files"] and metadata.version(package) == PACKAGES[package]["version"]
    path = metadata.distribution(package).locate_file(f"{PACKAGES[package]['folder']}/{file}")
    command = [sys.executable, str(TOP / "tests/robots/one.py"), str(path)]
    run = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)
    assert run.returncode == 0, run.stderr
    found = json.loads(run.stdout.splitlines()[-1])
    assert (found["why"], found["missed"], found["joints"]) == ("", [], joints)
    assert found["ripple"] <= 1e-3 and found["reversals"] <= 50.0


def test_the_page_has_what_was_asked_for() -> None:
    rows = [[cell.strip() for cell in row.split(" | ")] for row in PAGE.splitlines() if re.match(r"\| [a-z]+[\w-]* [\d.]+ \| `", row)]
    assert len(rows) == sum(len(about["files"]) for about in PACKAGES.values()) >= 60 and len(PACKAGES) >= 10
    assert sum(bool(row[3]) for row in rows) >= 57, "they load"
    why = [row[7].removesuffix(" |") for row in rows]
    assert sum(said == "arrives" for said in why) >= 55 and all(why), "each that does not says why"
    assert all(float(row[5]) <= 1.0 for row, said in zip(rows, why, strict=True) if said == "arrives"), "ripple at rest"
    assert all(float(row[6]) <= 50.0 for row, said in zip(rows, why, strict=True) if said == "arrives"), "no effort reverses faster"
    said = re.search(r"(\d+) files from (\d+) packages .*\n.* (\d+) files load, and with (\d+) of these every joint arrives", PAGE)
    assert said and [int(number) for number in said.groups()] == [
        len(rows),
        len(PACKAGES),
        sum(bool(row[3]) for row in rows),
        sum(said == "arrives" for said in why),
    ]
