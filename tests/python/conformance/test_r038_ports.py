# SPDX-License-Identifier: Apache-2.0
"""Requirements 38 to 57: ports, modes, invocations."""

from __future__ import annotations

import numpy as np
import pytest

import opengpac as gpac
from opengpac import _native, activate, execute
from opengpac import library as lib
from rig import Rig


def chain(rig: Rig, name: str = "chain") -> gpac.Verb:
    """Returns a counter that drives a copy."""
    return gpac.Verb(
        name,
        blocks={"count": rig.block("count.count"), "copy": rig.block("copy.copy")},
        instantiation_parameters={"y": "copy.y", "n": "copy.n"},
        cells={"c": ["count.y", "copy.u"]},
        command_lists={"start": [activate("count", every="1 ms"), activate("copy")]},
    )


def test_r038_ports_have_types_and_modes(rig: Rig) -> None:
    port = rig.block("ratio.slow_input").inputs["u"]
    assert (port.type, port.mode) == ("double", "ratio 10")


def test_r039_types_are_scalars_arrays_and_structs(rig: Rig) -> None:
    rig.block("pose.turn")
    pose = rig._modules["pose"].types.pose
    before, after = rig.cell.svv("before", pose), rig.cell.svv("after", pose)
    vector = rig.cell.svv("vector", "float[3]", initial=[1, 2, 3])
    assert vector.value.tolist() == [1, 2, 3] and vector.value.dtype == np.float32
    before.value = {"p": [1, 2, 3], "yaw": 0.25}
    turning = gpac.Verb(
        "turning",
        blocks={"turn": rig.block("pose.turn")},
        instantiation_parameters={"before": "turn.before", "after": "turn.after"},
        command_lists={"start": [execute("turn")]},
    )
    turning.on(rig.fast)(before, after)
    assert after.value["yaw"] == 0.75 and after.value["p"].tolist() == [1, 2, 3]


def test_r040_incompatible_types_are_refused(rig: Rig) -> None:
    wrong = rig.cell.svv("wrong", "float")
    with pytest.raises(gpac.TypeMismatch) as caught:
        rig.counting().on(rig.fast).new_instance(wrong)
    for part in ("wrong", "float", "double", "count.y", ".py:"):
        assert part in str(caught.value)


def test_r041_a_synchronous_input_is_served_once_for_each_value(rig: Rig) -> None:
    y, n = rig.cell.svv("y"), rig.cell.svv("n", "int64_t")
    chain(rig).on(rig.fast).asynch(y, n)
    rig.cell.advance("20 ms")
    assert (y.value, n.value) == (19, 20)


def test_r042_a_ratio_output_is_stored_on_every_nth_invocation(rig: Rig) -> None:
    y, n = rig.cell.svv("y", history=100), rig.cell.svv("n", "int64_t")
    verb = gpac.Verb(
        "decimating",
        blocks={"d": rig.block("ratio.every_fifth"), "copy": rig.block("copy.copy")},
        instantiation_parameters={"y": "copy.y", "n": "copy.n"},
        cells={"c": ["d.y", "copy.u"]},
        command_lists={"start": [activate("d", every="1 ms"), activate("copy")]},
    )
    verb.on(rig.fast).asynch(y, n)
    rig.cell.advance("22 ms")
    assert y.history[:]["value"].tolist() == [4, 9, 14, 19] and n.value == 4


def test_r042_a_ratio_input_takes_its_writers_value_by_number(rig: Rig) -> None:
    y = rig.cell.svv("y", history=100)
    slow = rig.cell.svv("slow")
    reading = gpac.Verb(
        "slow_reading",
        blocks={"r": rig.block("ratio.slow_input")},
        instantiation_parameters={"u": "r.u", "y": "r.y"},
        command_lists={"start": [activate("r", every="1 ms")]},
    )
    rig.counting("slowly", every="10 ms").on(rig.slow).asynch(slow)
    reading.on(rig.fast).asynch(slow, y)
    rig.cell.advance("60 ms")
    values = y.history[:]["value"].tolist()
    # Invocation j takes the writer's number j // 10 - 1; before that the initial value stays.
    assert values == [max(0.0, j // 10 - 1) for j in range(60)]


def test_r043_an_asynchronous_input_takes_the_newest_value(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    sampling = gpac.Verb(
        "sampling",
        blocks={"s": rig.block("copy.sample")},
        instantiation_parameters={"u": "s.u", "y": "s.y"},
        command_lists={"start": [activate("s", every="10 ms")]},
    )
    rig.counting().on(rig.fast).asynch(a)
    sampling.on(rig.slow).asynch(a, b)
    rig.cell.advance("105 ms")
    assert 90 <= b.value <= 100


def test_r044_data_driven_blocks_run_on_new_values_only(rig: Rig) -> None:
    """A data-driven block runs as often as its writer, however often its source fires, and not at all without a writer."""
    y, n = rig.cell.svv("y"), rig.cell.svv("n", "int64_t")
    beside = rig.cell.svv("beside")
    verb = gpac.Verb(
        "thrice",
        blocks={"count": rig.block("count.count"), "copy": rig.block("copy.copy")},
        instantiation_parameters={"y": "copy.y", "n": "copy.n"},
        cells={"c": ["count.y", "copy.u"]},
        command_lists={"start": [activate("copy"), activate("count", every="10 ms")]},
    )
    rig.counting("beside").on(rig.fast).asynch(beside)
    verb.on(rig.fast).asynch(y, n)
    rig.cell.advance("35 ms")
    assert (n.value, y.value, beside.value) == (3, 2, 34)
    never, n_never = rig.cell.svv("never"), rig.cell.svv("n_never", "int64_t")
    follower = rig.copying().on(rig.fast)
    silent = rig.counting("silent").on(rig.fast).new_instance(never)
    follower.asynch(never, *rig.svvs("y_never"), n_never)
    rig.cell.advance("35 ms")
    assert (n.value, n_never.value, beside.value) == (7, 0, 69), "its writer is there, and has not written"
    silent.start()
    rig.cell.advance("5 ms")
    assert n_never.value == 5
    with pytest.raises(gpac.SchedulingError, match=r"nothing drives input 'copy\.u'"):
        follower.new_instance(*rig.svvs("nobodys", "y_nobodys"), rig.cell.svv("n_nobodys", "int64_t"))


def test_r045_neither_a_write_nor_an_old_value_fires_anything(rig: Rig) -> None:
    """A firing requires a new value, written by another instance through an output port."""
    u, y = rig.cell.svv("u"), rig.cell.svv("y", history=50)
    n, beside = rig.cell.svv("n", "int64_t"), rig.cell.svv("beside")
    writer = rig.counting("writing").on(rig.fast).new_instance(u)
    writer.start(limit=5)
    assert writer.wait().condition == "enough" and u.value >= 5, "there is a value, and it is old"
    reader = rig.copying().on(rig.fast).asynch(u, y, n)
    rig.counting("beside").on(rig.fast).asynch(beside)

    def firings(count: int) -> None:
        before = beside.value
        rig.until(lambda: beside.value >= before + count, "its source fires")

    firings(20)
    assert n.value == 0, "an old value"
    u.value = 17.0
    firings(20)
    assert n.value == 0, "a write of the programming system"
    writer.start(limit=3)
    writer.wait()
    firings(20)
    assert (n.value, y.history[:]["value"].tolist()[:4]) == (len(y.history), [0, 1, 2, 3]), "each new value, once"
    count = n.value
    reader.suspend()
    reader.resume()
    u.value = 18.0
    firings(20)
    assert n.value == count, "nor does it have one twice after a pause"


def test_r046_an_interval_schedules_a_block(rig: Rig) -> None:
    (a,) = rig.svvs("a")
    rig.counting(every="5 ms").on(rig.fast).asynch(a)
    rig.cell.advance("50 ms")
    assert a.value == 9


def test_r047_a_trigger_schedules_a_block(rig: Rig) -> None:
    button = rig.rtp.trigger("button", priority=50)
    (a,) = rig.svvs("a")
    rig.counting(command_lists={"start": [activate("count")]}).on(button).asynch(a)
    button.request()
    rig.cell.advance("1 ms")
    button.request()
    rig.cell.advance("1 ms")
    assert a.value == 1


def test_r048_the_mean_frequency_is_the_one_asked_for(rig: Rig) -> None:
    a = rig.cell.svv("a", history=2000)
    rig.counting().on(rig.fast).asynch(a)
    rig.cell.advance("1 s")
    times = a.history[:]["time"]
    assert len(times) == 1000
    np.testing.assert_allclose(np.diff(times), 1e-3, atol=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_r049_outputs_invisible_until_complete(built: dict[str, str], seed: int) -> None:
    """An invocation lasts 4 ms of the virtual clock: the programming system, which looks every ms, sees the value then, and no earlier."""
    with gpac.System("cell", clock="virtual", seed=seed) as cell:
        rig = Rig(cell, built)
        long = rig.rtp.timer("long", period="10 ms", priority=10, virtual_cost="4 ms")
        a = cell.svv("a", history=100)
        rig.counting(every="10 ms").on(long).asynch(a)
        for at in range(1, 60):
            cell.advance("1 ms")
            complete = max(0, (at - 4) // 10)
            assert (len(a.history), a.value) == (complete, max(0, complete - 1)), f"at {at} ms"


@pytest.mark.parametrize("seed", range(5))
def test_r050_a_reader_sees_outputs_of_one_invocation(built: dict[str, str], seed: int) -> None:
    with gpac.System("cell", clock="virtual", seed=seed) as cell:
        rig = Rig(cell, built)
        writer = rig.rtp.timer("writer", period="3 ms", priority=10, virtual_cost="1 ms")
        a, b, torn, seen = rig.svvs("a", "b", "torn", "seen")
        writing = gpac.Verb(
            "writing",
            blocks={"pair": rig.block("pair.pair")},
            instantiation_parameters={"a": "pair.a", "b": "pair.b"},
            command_lists={"start": [activate("pair", every="3 ms")]},
        )
        checking = gpac.Verb(
            "checking",
            blocks={"check": rig.block("pair.pair_check")},
            instantiation_parameters={"a": "check.a", "b": "check.b", "torn": "check.torn", "seen": "check.seen"},
            command_lists={"start": [activate("check", every="1 ms")]},
        )
        writing.on(writer).asynch(a, b)
        checking.on(rig.fast).asynch(a, b, torn, seen)
        for _ in range(50):
            rig.cell.advance("7 ms")
            pair = rig.cell.read(a, b)
            assert pair[0] + pair[1] == 0
        assert torn.value == 0 and seen.value > 90


def test_r050_a_snapshot_belongs_together_on_every_interconnect(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    writing = gpac.Verb(
        "writing",
        blocks={"pair": rig.block("pair.pair")},
        instantiation_parameters={"a": "pair.a", "b": "pair.b"},
        command_lists={"start": [activate("pair", every="1 ms")]},
    )
    writing.on(rig.fast).asynch(a, b)
    for _ in range(20):
        rig.cell.advance("3 ms")
        snapshot = rig.cell.read(a, b)
        assert snapshot[0] == -snapshot[1] and snapshot.numbers[0] == snapshot.numbers[1]


def test_r051_a_faulted_invocation_publishes_nothing_and_keeps_its_state(rig: Rig) -> None:
    (y,) = rig.svvs("y", history=20)
    verb = gpac.Verb(
        "once_bad",
        blocks={"b": rig.block("faults.not_a_number")},
        instantiation_parameters={"y": "b.y"},
        command_lists={"start": [activate("b", every="1 ms")]},
        transitions={("start", "fault"): "start"},
    )
    verb.on(rig.fast).asynch(y)
    rig.cell.advance("8 ms")
    values = y.history[:]["value"].tolist()
    assert values == [1, 2, 3, *range(4, 4 + len(values) - 3)], "the bad sample left no trace in the state"
    assert len(values) >= 6


def test_r052_faults_of_the_network_stay_below_the_application(rig: Rig) -> None:
    other = rig.cell.processor("rtp1").timer("fast", period="1 ms", priority=80)
    a, b, torn, seen = rig.svvs("a", "b", "torn", "seen")
    writing = gpac.Verb(
        "writing",
        blocks={"pair": rig.block("pair.pair")},
        instantiation_parameters={"a": "pair.a", "b": "pair.b"},
        command_lists={"start": [activate("pair", every="1 ms")]},
    )
    checking = gpac.Verb(
        "checking",
        blocks={"check": rig.block("pair.pair_check")},
        instantiation_parameters={"a": "check.a", "b": "check.b", "torn": "check.torn", "seen": "check.seen"},
        command_lists={"start": [activate("check", every="1 ms")]},
    )
    writing.on(rig.fast).asynch(a, b)
    checking.on(other).asynch(a, b, torn, seen)
    rig.cell.advance("1 s")
    assert torn.value == 0
    assert seen.value > 950


def test_r053_instances_of_one_block_have_different_rates(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    counting = rig.counting()
    counting.on(rig.fast).asynch(a)
    counting.on(rig.fast, every={"count": "4 ms"}).asynch(b)
    rig.cell.advance("40 ms")
    assert (a.value, b.value) == (39, 9)


def test_r054_rates_change_without_recompiling(rig: Rig) -> None:
    (a,) = rig.svvs("a")
    counting = rig.counting()
    for every, expected in (("1 ms", 19), ("2 ms", 9)):
        vi = counting.on(rig.fast, every={"count": every}).asynch(a)
        rig.cell.advance("20 ms")
        assert a.value == expected
        vi.halt()
        vi.wait()


def test_r055_a_program_gives_the_same_values_on_both_interconnects(built: dict[str, str]) -> None:
    found = []
    for kind in ("memory", "message"):
        with gpac.System("cell", clock="virtual", interconnect=kind) as cell:
            rig = Rig(cell, built)
            y, n = cell.svv("y", history=100), cell.svv("n", "int64_t")
            chain(rig).on(rig.fast).asynch(y, n)
            cell.advance("50 ms")
            found.append(y.history[:]["value"].tolist())
    assert found[0] == found[1] and len(found[0]) == 50


def test_r056_types_and_units_are_checked(rig: Rig) -> None:
    newtons = rig.cell.svv("newtons", unit="N")
    drive = gpac.Verb(
        "guarding",
        blocks={"near": lib.block("in_position")(n=1)},
        instantiation_parameters={"sensed": "near.sensed", "goal": "near.goal"},
        command_lists={"start": [activate("near", every="1 ms")]},
    )
    with pytest.raises(gpac.UnitMismatch, match="rad"):
        drive.on(rig.fast).new_instance([newtons], rig.svvs("goal"))


def test_r057_the_block_interface_has_no_synchronisation() -> None:
    header = _native.header_text()
    assert not any(word in header for word in ("mutex", "semaphore", "pthread"))


def test_r042_the_history_of_a_ratio_output_has_what_was_stored(rig: Rig) -> None:
    y = rig.cell.svv("y", history=100)
    verb = gpac.Verb(
        "decimating",
        blocks={"d": rig.block("ratio.every_fifth")},
        instantiation_parameters={"y": "d.y"},
        command_lists={"start": [activate("d", every="1 ms")]},
    )
    verb.on(rig.fast).asynch(y)
    rig.cell.advance("22 ms")
    assert y.history[:]["value"].tolist() == [4, 9, 14, 19]
    assert y.history[:]["number"].tolist() == [4, 9, 14, 19]
