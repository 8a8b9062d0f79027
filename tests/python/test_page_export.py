# SPDX-License-Identifier: Apache-2.0
"""The page's MCAP export can be read by `open_recording`, like a recording. The file is written by studio's `files.test.ts`."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

import opengpac as gpac

FILE = Path(__file__).parents[2] / "studio/src/views/scope/signal/exported.testing.mcap"


def test_an_export_of_the_page_is_a_recording() -> None:
    recorded = gpac.open_recording(FILE)
    assert recorded.complete and not recorded.damage and set(recorded) == {"arm.sensed", "force", "pid#1:e"}
    sensed = recorded["arm.sensed"]
    assert sensed["value"].tolist() == [0.1, 1 / 3, 5.0] and sensed["number"].tolist() == [1, 2, 6]
    assert np.array_equal(np.rint(sensed["time"] * 1e9), [1_000_000_001, 1_001_000_000, 1_005_000_000])
    assert recorded.unit("arm.sensed") == "rad" and recorded.lost == {"arm.sensed": 3}
    assert recorded.metadata["missing"] == {"1": "arm.sensed: 3 lost, behind 1.001000000 s and before 1.005000000 s"}
    force = recorded["force"]["value"]
    assert (force["x"].tolist(), force["y"].tolist()) == ([7.0], [[8.0]])
    odd = recorded["pid#1:e"]["value"]
    assert odd["on"].tolist() == [True] and math.isinf(odd["size"][0]), "truth values and infinities of structs are what they were"
