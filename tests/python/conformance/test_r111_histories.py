# SPDX-License-Identifier: Apache-2.0
"""Requirement 111, the history of an SVV: blocks read the last values without locks, Python reads them with their times."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import opengpac as gpac
from opengpac import activate
from rig import Rig

HISTORY = Path(__file__).parents[2] / "blocks" / "history.c"


def reading(rig: Rig, name: str = "reading", every: str = "1 ms") -> gpac.Verb[..., Any]:
    """Returns a verb that stores the last four values of `u` in `seen`."""
    return gpac.Verb(
        name,
        blocks={"r": rig.block("history.last_four")},
        instantiation_parameters={"u": "r.u", "seen": "r.seen"},
        command_lists={"start": [activate("r", every=every)]},
    )


def consecutive(rows: np.ndarray) -> bool:
    """Returns whether the four values in each row are consecutive; the first stands for earlier ones."""
    steps = np.diff(rows, axis=1)
    return bool(np.isin(steps, (0, 1)).all()) and bool((steps[10:] == 1).all())


@pytest.mark.parametrize("where", ["same source", "other source", "other processor"])
def test_r111_a_block_reads_the_last_values(rig: Rig, where: str) -> None:
    other = rig.cell.processor("rtp1").timer("fast", period="1 ms", priority=80)
    reader = {"same source": rig.fast, "other source": rig.rtp.timer("beside", period="1 ms", priority=20), "other processor": other}[where]
    u = rig.cell.svv("u", history=4)
    seen = rig.cell.svv("seen", "double[4]", history=200)
    rig.counting().on(rig.fast).asynch(u)
    reading(rig).on(reader).asynch(u, seen)
    rig.cell.advance("100 ms")
    rows = seen.history[:]["value"]
    assert len(rows) == 100 and consecutive(rows)
    assert rows[-1][-1] >= 95


def test_r111_entries_not_yet_written_are_the_present_value(rig: Rig) -> None:
    u = rig.cell.svv("u", initial=7.0, history=4)
    seen = rig.cell.svv("seen", "double[4]")
    reading(rig).on(rig.slow, every={"r": "10 ms"}).asynch(u, seen)
    rig.cell.advance("10 ms")
    assert seen.value.tolist() == [7, 7, 7, 7]


def test_r111_stores_of_the_programming_system_are_values(rig: Rig) -> None:
    u = rig.cell.svv("u", history=10)
    seen = rig.cell.svv("seen", "double[4]")
    reading(rig).on(rig.fast).asynch(u, seen)
    for value in (1.0, 2.0, 3.0, 4.0, 5.0):
        u.value = value
        rig.cell.advance("5 ms")
    assert seen.value.tolist() == [2, 3, 4, 5]
    assert u.history[:]["value"].tolist() == [1, 2, 3, 4, 5]
    assert u.history[-1]["time"] == pytest.approx(0.020)


def test_r111_what_input_parameters_store_is_a_value(rig: Rig) -> None:
    u = rig.cell.svv("u", history=4)
    seen = rig.cell.svv("seen", "double[4]")
    verb = gpac.Verb(
        "storing",
        blocks={"r": rig.block("history.last_four")},
        instantiation_parameters={"u": "r.u", "seen": "r.seen"},
        input_parameters={"value": gpac.input("r.u", tunable=True)},
        command_lists={"start": [activate("r", every="1 ms")]},
    )
    vi = verb.on(rig.fast).asynch(u, seen, 3.0)
    assert vi.inputs == {"value": 3.0}
    vi.set(value=4.0)
    assert vi.inputs == {"value": 4.0}
    rig.cell.advance("5 ms")
    assert seen.value.tolist() == [0, 0, 3, 4]


def test_r111_a_private_cell_has_a_history_where_a_block_reads_it(rig: Rig) -> None:
    other = rig.cell.processor("rtp1").timer("fast", period="1 ms", priority=80)
    seen, y = rig.cell.svv("seen", "double[4]", history=50), rig.cell.svv("y")
    count, slope, last = (rig.block(name) for name in ("count.count", "history.slope", "history.last_four"))
    graph = gpac.Graph("inner", blocks={"slope": slope}, inputs={"u": "slope.u"}, outputs={"y": "slope.y"})
    verb = gpac.Verb(
        "deriving",
        blocks={"count": count, "inner": graph, "last": last},
        instantiation_parameters={"y": "inner.y", "seen": "last.seen"},
        cells={"u": ["count.y", "inner.u", "last.u"]},
        command_lists={"start": [activate("count", every="1 ms"), activate("inner", every="1 ms"), activate("last", every="1 ms")]},
    )
    vi = verb.on({"last": other, "*": rig.fast}).new_instance(y, seen)
    for _ in range(2):
        vi.start()
        rig.cell.advance("30 ms")
        assert y.value == 1.0 and (np.diff(seen.value) == 1).all()
        vi.halt()
        vi.wait()
    first = seen.history[:]["value"]
    assert (first[:, -1] - first[:, 0] <= 3).all(), "a start forgets what the cell held before"


def test_r111_a_ratio_output_appends_what_it_stores(rig: Rig) -> None:
    u, seen = rig.cell.svv("u", history=4), rig.cell.svv("seen", "double[4]")
    verb = gpac.Verb(
        "decimating",
        blocks={"d": rig.block("ratio.every_fifth")},
        instantiation_parameters={"u": "d.y"},
        command_lists={"start": [activate("d", every="1 ms")]},
    )
    reading(rig).on(rig.fast).asynch(u, seen)
    verb.on(rig.fast).asynch(u)
    rig.cell.advance("28 ms")
    assert seen.value.tolist() == [9, 14, 19, 24]


def test_r111_the_history_outlives_its_writers(rig: Rig) -> None:
    u = rig.cell.svv("u", history=4)
    seen = rig.cell.svv("seen", "double[4]", history=100)
    reading(rig).on(rig.fast).asynch(u, seen)
    first = rig.counting().on(rig.fast).new_instance(u)
    second = rig.counting("second", every="10 ms").on(rig.slow).new_instance(u)
    first.start()
    rig.cell.advance("5 ms")
    first.halt()
    first.wait()
    second.start()
    rig.cell.advance("16 ms")
    assert seen.value.tolist() == [3, 4, 0, 1], "one SVV, two writers in two sources, one history"


def test_r111_an_invocation_that_faults_appends_nothing(rig: Rig) -> None:
    u = rig.cell.svv("u", history=4)
    seen = rig.cell.svv("seen", "double[4]", history=100)
    verb = gpac.Verb(
        "once_bad",
        blocks={"b": rig.block("faults.not_a_number")},
        instantiation_parameters={"y": "b.y"},
        command_lists={"start": [activate("b", every="1 ms")]},
        transitions={("start", "fault"): "start"},
    )
    reading(rig).on(rig.fast).asynch(u, seen)
    verb.on(rig.fast).asynch(u)
    rig.cell.advance("10 ms")
    assert (np.diff(seen.value) == 1).all() and np.isfinite(seen.history[:]["value"]).all()


def test_r111_structs_and_arrays_have_histories(rig: Rig) -> None:
    code = rig.cell.download(str(HISTORY), "history")
    s, a = rig.cell.svv("s", code.types.sample, history=8), rig.cell.svv("a", "double[2]", history=8)
    seen, arrays = rig.cell.svv("seen", "int32_t[3]"), rig.cell.svv("arrays", "double[4]")
    verb = gpac.Verb(
        "sampling",
        blocks={"w": code.sampling, "r": code.last_samples},
        instantiation_parameters={"s": ["w.s", "r.s"], "a": ["w.a", "r.a"], "seen": "r.seen", "arrays": "r.arrays"},
        command_lists={"start": [activate("w", every="1 ms"), activate("r", every="1 ms")]},
    )
    verb.on(rig.fast).asynch(s, a, seen, arrays)
    rig.cell.advance("10 ms")
    assert seen.value.tolist() == [7, 8, 9]
    assert arrays.value.tolist() == [8, -8, 9, -9]
    past = s.history[-2:]
    assert past["value"]["k"].tolist() == [8, 9] and past["value"]["p"].tolist() == [[8, -8], [9, -9]]
    assert past["number"].tolist() == [8, 9]
    np.testing.assert_allclose(past["time"], [0.009, 0.010])
    assert a.history[2:4]["value"].tolist() == [[4, -4], [5, -5]]


@pytest.mark.parametrize("kept", [0, 3])
def test_r111_a_history_too_short_is_refused(memory_rig: Rig, kept: int) -> None:
    u = memory_rig.cell.svv("u", history=kept)
    seen = memory_rig.cell.svv("seen", "double[4]")
    words = r"cannot bind SVV 'u' to input 'r\.u' \(double, the last 4\): the SVV keeps (none|3); create the SVV with history=4 at .*:\d+"
    with pytest.raises(gpac.TypeMismatch, match=words) as caught:
        reading(memory_rig).on(memory_rig.fast).new_instance(u, seen)
    assert [end.what for end in caught.value.ends] == ["SVV 'u'", "input 'r.u' (double, the last 4)"]
    assert memory_rig.cell.names["instances"] == []


def test_r111_a_history_is_tried_without_a_system() -> None:
    code = gpac.System("cell", clock="virtual").download(str(HISTORY))
    trial = code.last_four.run(u=[1.0, 2.0, 3.0])
    assert trial.seen.tolist() == [[1, 1, 1, 1], [1, 1, 1, 2], [1, 1, 2, 3]]


def test_r111_a_history_has_one_length(tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.c"
    items = 'size(n, 1, 4), in_history(double[n], u, 4, "u"), out(double, y, "y")'
    wrong.write_text(f'#include <opengpac.h>\nFUNCTION_BLOCK(wrong, "w", {items}) {{ return OK; }}\n')
    with pytest.raises(gpac.ModuleError, match="all values of a history must have the same length"):
        gpac.System("cell", clock="virtual").download(str(wrong))
