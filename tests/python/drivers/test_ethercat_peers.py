# SPDX-License-Identifier: Apache-2.0
"""Third-party main devices accept the emulated EtherCAT segment. Requires the rights to create a network namespace."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

SOEM = Path(__file__).parent / "ethercat_soem.py"


@pytest.fixture(scope="module")
def said() -> dict[str, Any]:
    run = subprocess.run(["unshare", "--net", sys.executable, str(SOEM)], capture_output=True, text=True, timeout=120)
    assert run.returncode == 0, (
        f"{run.stderr}\nthis test makes a network namespace: run it as root, or with CAP_NET_ADMIN and CAP_SYS_ADMIN"
    )
    return json.loads(run.stdout.splitlines()[-1])


def test_soem_finds_the_drives(said: dict[str, Any]) -> None:
    assert (said["found"], said["name"], said["identity"]) == (3, "drive", [0x6A1C, 0x402, 1])


def test_soem_reads_and_writes_objects(said: dict[str, Any]) -> None:
    assert said["read"] == "drive"
    assert said["segmented"] > 128, "longer than a mailbox"
    assert said["written"]
    assert said["abort"] == 0x06020000


def test_soem_brings_them_to_op(said: dict[str, Any]) -> None:
    assert said["states"] == [[8, 0]] * 3
    assert said["clocks"]
    assert said["bytes"] == 3 * (13 + 15)


def test_soem_measures_the_delays_that_we_do(said: dict[str, Any]) -> None:
    assert said["our_states"] == ["OP"] * 3
    assert all(count > 0 for count in said["our_sync0"])
    assert said["left_delays"] == said["our_delays"]
    for measured in (said["delays"], said["our_delays"]):
        assert measured == pytest.approx([0, 420, 1720], abs=2)


def test_soem_moves_their_axes(said: dict[str, Any]) -> None:
    # 2 for each written terminal, 1 for each read one.
    assert said["counter"] == said["expected"] == 9
    assert said["enabled"] == [0x27] * 3, "operation enabled"
    assert said["positions"] == [2000] * 3
    assert said["far"] == [[0x08, 0x8611]] * 3, "a target that is too far away is a following error"


def test_soem_reads_and_drives_the_wires_of_terminals(said: dict[str, Any]) -> None:
    assert said["terminals_states"] == [[8, 0]] * 4
    assert said["sizes"] == [[0, 0], [1, 0], [0, 2], [8, 2]]
    assert said["terminals_counter"] == said["terminals_expected"] == 6
    assert said["digital"] == 1 << 5
    assert said["analog"] == [0, 0, 0, -1234]
    assert said["carried"] == [[], [], [1, 0, 0, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 0, 0, 0], [4321]]
