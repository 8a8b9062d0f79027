# SPDX-License-Identifier: Apache-2.0
"""Requirements 58 to 73: processes, installation, command lists."""

from __future__ import annotations

from collections.abc import Callable

import pytest

import opengpac as gpac
from opengpac import activate, deactivate, execute, install, wait
from rig import Rig


def two_counters(rig: Rig, commands: list[gpac.Command], **changes: object) -> gpac.Verb:
    """Returns a verb with two counters, `a` and `b`, each into an SVV of that name."""
    definition = {
        "blocks": {"a": rig.block("count.count"), "b": rig.block("count.count")},
        "instantiation_parameters": {"a": "a.y", "b": "b.y"},
        "command_lists": {"start": commands},
        **changes,
    }
    return gpac.Verb("two", **definition)  # type: ignore[arg-type]


def counted(rig: Rig, counter: gpac.SVV, limit: int) -> bool:
    """Returns whether a counter reached its limit and was then stopped: in real time it continues until the supervisor has answered."""
    return counter.value == limit if rig.cell.virtual else counter.value >= limit


def test_r058_a_process_is_a_set_of_block_instances(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    two_counters(rig, [activate("a", every="1 ms"), activate("b", every="1 ms")]).on(rig.fast).asynch(a, b)
    rig.cell.advance("5 ms")
    assert (a.value, b.value) == (4, 4)


@pytest.mark.parametrize("command", [execute, install, deactivate, lambda label: activate(label, every="1 ms")])
def test_r059_a_block_that_is_not_installed_cannot_be_executed(rig: Rig, command: Callable[[str], gpac.Command]) -> None:
    """Neither a name that does not exist can be executed, nor a block of another verb whose instance is installed and runs."""
    a, b, y = rig.svvs("a", "b", "y")
    other = rig.counting().on(rig.fast).asynch(y)
    for label in ("aa", "count"):
        with pytest.raises(gpac.UnknownName, match=f"'{label}'"):
            two_counters(rig, [activate("a", every="1 ms"), command(label)])
    two_counters(rig, [command("a"), execute("b")]).on(rig.fast).new_instance(a, b)
    assert other.state == "running"


def test_r059_what_is_deleted_or_not_started_does_not_run(rig: Rig) -> None:
    a, b = rig.svvs("a", "b", history=5)
    instance = two_counters(rig, [activate("a", every="1 ms"), activate("b", every="1 ms")]).on(rig.fast).new_instance(a, b)
    (beside,) = rig.svvs("beside")
    other = rig.counting().on(rig.fast).asynch(beside)
    rig.until(lambda: beside.value >= 10, "its source fires")
    assert len(a.history) == len(b.history) == 0, "it is installed, and nobody has commanded its execution"
    instance.delete()
    with pytest.raises(gpac.InvalidState, match="deleted"):
        instance.start()
    with pytest.raises(gpac.UnknownName):
        rig.cell.instance("two#1").start()
    assert other.state == "running"


def test_r060_installation_binds_ports_and_attaches_to_source_and_processor(rig: Rig) -> None:
    """Each block writes the SVV bound to it, in the firings of its source; there is no binding before or afterwards."""
    elsewhere = rig.cell.processor("rtp1").timer("slow", period="10 ms", priority=60)
    a, b = rig.svvs("a", "b", history=20)

    def steps() -> list[int]:
        return [rig.cell.statistics["sources"][name]["steps"] for name in ("rtp0.fast", "rtp0.slow", "rtp1.slow")]

    verb = two_counters(
        rig,
        [activate("a", every="1 ms"), activate("b", every="10 ms")],
        input_parameters={"at_a": gpac.input("a.enough", default=0)},
        conditions={"enough": gpac.on("a.enough")},
    )
    idle = steps()
    instance = verb.on({"a": rig.fast, "b": elsewhere}).new_instance(b, a)
    assert [(block["label"], block["source"]) for block in instance._about()["blocks"]] == [("a", "rtp0.fast"), ("b", "rtp1.slow")]
    for svv in (a, b):
        with pytest.raises(gpac.InvalidState, match=f"'{svv.name}': it is bound by 'two#1'"):
            svv.delete()
    instance.start()
    rig.cell.advance("40 ms")
    assert [round(t * 1000) for t in a.history[:]["time"]] == [10, 20, 30, 40], "given as b: it follows the timer of the other processor"
    assert b.value == 39
    running = steps()
    assert [now - before for now, before in zip(running, idle, strict=True)] == [1, 0, 1]
    instance.halt()
    instance.delete()
    for svv in (a, b):
        svv.delete()


def test_r061_a_second_writer_is_refused(rig: Rig) -> None:
    (a,) = rig.svvs("a")
    rig.counting().on(rig.fast).named("first").asynch(a)
    second = rig.counting("other").on(rig.fast).new_instance(a)
    with pytest.raises(gpac.SecondWriter, match="first"):
        second.start()
    assert second.state == "created"
    rig.cell.advance("5 ms")
    assert a.value == 4, "the first one runs on"


def test_r061_two_writers_in_one_verb_are_refused(rig: Rig) -> None:
    with pytest.raises(gpac.SecondWriter):
        two_counters(
            rig,
            [activate("a", every="1 ms"), activate("b", every="1 ms")],
            instantiation_parameters={"a": ["a.y", "b.y"]},
        ).on(rig.fast).new_instance(*rig.svvs("x"))


def test_r062_rates_that_cannot_hold_are_refused(rig: Rig) -> None:
    (a,) = rig.svvs("a")
    with pytest.raises(gpac.SchedulingError, match=r"1\.5 ms"):
        rig.counting(every="1.5 ms").on(rig.fast).new_instance(a)


def test_r063_a_failed_installation_leaves_nothing(rig: Rig) -> None:
    wrong = rig.cell.svv("wrong", "float")
    before = rig.cell.names
    with pytest.raises(gpac.TypeMismatch):
        rig.counting().on(rig.fast).new_instance(wrong)
    after = rig.cell.names
    assert after["instances"] == before["instances"]
    wrong.delete()


def test_r063_all_errors_come_at_once(rig: Rig) -> None:
    wrong, worse = rig.cell.svv("wrong", "float"), rig.cell.svv("worse", "int32_t")
    with pytest.raises(gpac.InstallationErrors) as caught:
        two_counters(rig, [activate("a", every="1 ms")]).on(rig.fast).new_instance(wrong, worse)
    assert len(caught.value.errors) == 2
    assert all(isinstance(error, gpac.TypeMismatch) for error in caught.value.errors)


def test_r064_a_process_installs_executes_and_waits(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    verb = two_counters(
        rig,
        [install("a", "b"), execute("a"), activate("b", every="1 ms"), wait("b.enough"), deactivate("b")],
        input_parameters={"limit": "b.enough"},
    )
    report = verb.on(rig.fast)(a, b, limit=5, time_limit="60 s")
    assert report.condition == "completed" and a.value == 0 and counted(rig, b, 5)


def test_r065_install_gives_fresh_state(rig: Rig) -> None:
    (y,) = rig.svvs("y", history=20)
    verb = gpac.Verb(
        "again",
        blocks={"m": rig.block("memory.memory")},
        instantiation_parameters={"y": "m.forgets"},
        command_lists={"start": [execute("m"), execute("m"), install("m"), execute("m")]},
    )
    verb.on(rig.fast)(y)
    assert y.value == 1


def test_r066_execute_runs_once_before_the_next_command(rig: Rig) -> None:
    (y,) = rig.svvs("y")
    verb = gpac.Verb(
        "twice",
        blocks={"count": rig.block("count.count"), "sample": rig.block("copy.sample")},
        instantiation_parameters={"y": "sample.y"},
        cells={"c": ["count.y", "sample.u"]},
        command_lists={"start": [execute("count"), execute("count"), execute("sample")]},
    )
    report = verb.on(rig.fast)(y)
    assert report.condition == "completed" and y.value == 1


def test_r067_activate_does_not_block(rig: Rig) -> None:
    a, b = rig.svvs("a", "b", initial=-1.0)
    two_counters(rig, [activate("a", every="1 ms"), execute("b")]).on(rig.fast).asynch(a, b)
    rig.cell.advance("5 ms")
    assert (a.value, b.value) == (4, 0)


def test_r068_wait_ends_on_a_condition_or_when_nothing_is_active(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    verb = two_counters(
        rig,
        [activate("a", every="1 ms"), wait("a.enough"), deactivate("a"), wait(), execute("b")],
        input_parameters={"limit": "a.enough"},
    )
    report = verb.on(rig.fast)(a, b, limit=3, time_limit="60 s")
    assert report.condition == "completed" and b.value == 0 and counted(rig, a, 3)


def test_r068_wait_for_a_time(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    report = two_counters(rig, [activate("a", every="1 ms"), wait("10 ms"), deactivate("a")]).on(rig.fast)(a, b)
    assert report.condition == "completed" and report.time >= 0.01
    assert 9 <= a.value <= 10 or not rig.cell.virtual


def test_r069_a_time_limit_is_a_condition(rig: Rig) -> None:
    (a,) = rig.svvs("a")
    with pytest.raises(gpac.Terminated) as caught:
        rig.counting().on(rig.fast)(a, time_limit="20 ms")
    assert caught.value.condition == "time_limit" and caught.value.time >= 0.019
    assert caught.value.time <= 0.021 or not rig.cell.virtual


def test_r070_commands_take_block_instances(rig: Rig) -> None:
    assert activate("b", every="1 ms")["block"] == "b"
    with pytest.raises(gpac.DefinitionError, match="not a command"):
        two_counters(rig, ["activate a"])  # type: ignore[list-item]


def test_r071_a_process_has_a_list_and_conditions(rig: Rig) -> None:
    (a,) = rig.svvs("a")
    verb = rig.counting()
    assert verb.table() == [("start", "enough", "ends, returns last")]
    assert verb.on(rig.fast)(a, limit=2).condition == "enough"


def test_r072_the_papers_example_runs(cell: gpac.System) -> None:
    rtp = cell.processor("rtp0")
    slow = rtp.timer("slow", period="20 ms", priority=60)
    fast = rtp.timer("fast", period="1 ms", priority=80)
    drive = rtp.physical_device("drive", gpac.drivers.loopback("x", "y"), exchange=fast)
    # On a busy machine they follow late, which is not measured here.
    gains = {"kp": 50.0, "kd": 0.0, "max_following_error": 10.0}
    arm = gpac.Group("arm", *(gpac.robots.Joint(name, drive=drive[name], on=fast, **gains) for name in drive.parts))
    arm.enable()
    report = gpac.robots.move.on(slow)(arm, [0.5, -0.25], speed=1.0, time_limit="60 s")
    assert report.condition == "arrived"
    assert abs(report.position - [0.5, -0.25]).max() < 0.002
    assert report.time >= report.duration > 0.3


def test_r073_processes_share_svvs(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    sampling = gpac.Verb(
        "sampling",
        blocks={"s": rig.block("copy.sample")},
        instantiation_parameters={"u": "s.u", "y": "s.y"},
        command_lists={"start": [activate("s", every="10 ms")]},
    )
    rig.counting().on(rig.fast).asynch(a)
    sampling.on(rig.slow).asynch(a, b)
    rig.cell.advance("50 ms")
    assert b.value >= 30
