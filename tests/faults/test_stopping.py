# SPDX-License-Identifier: Apache-2.0
"""A few stops under hostile connections; `make faults` makes thousands."""

from __future__ import annotations

from pathlib import Path

from stopping import VERBS, campaign


def test_every_stop_is_answered_beside_hostile_connections(tmp_path: Path) -> None:
    found = campaign(stops=24, hostile=20, seed=1, folder=tmp_path)
    assert not found.wrong, "\n".join(found.wrong)
    assert sum(map(len, found.times_ms.values())) == 24
    assert {name.partition(",")[0] for name in found.times_ms} == {*VERBS}
    assert found.out_s is not None and any(name.startswith("check ") for name in found.hostile), found.hostile
