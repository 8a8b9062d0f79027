# SPDX-License-Identifier: Apache-2.0
"""A few seconds of the soak, under the virtual clock; `make soak` takes hours of real time."""

from __future__ import annotations

from pathlib import Path

import opengpac as gpac
from soak import Found, build, soak

SECONDS = 3.0


def test_nothing_is_lost(tmp_path: Path) -> None:
    found = Found(blocks=1000, asked_s=SECONDS)
    with gpac.System("soak", clock="virtual", progress=False) as cell:
        soak(cell, build(tmp_path), found, tmp_path, is_virtual=True)
    assert (found.lost, found.wrong, found.interrupted) == ({}, [], False)
    assert found.verbs == SECONDS * 20 and found.numbers >= SECONDS * 1000 and found.overruns == 0
    assert found.rows >= SECONDS * 1000 - 1 and found.values_in_frames > 0
