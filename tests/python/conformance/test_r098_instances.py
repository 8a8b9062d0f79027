# SPDX-License-Identifier: Apache-2.0
"""Requirements 98 to 110: verb instances, supervisor, kernels."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

import opengpac as gpac
from afar import resident_kb, until
from daemons import Daemon
from opengpac import activate, execute
from opengpac.application.application import application_json
from rig import Rig


def test_r098_an_instance_holds_instances_of_all_blocks_of_its_verb(rig: Rig) -> None:
    """This includes blocks that its first list does not name; and each instance of the verb has its own."""
    verb = gpac.Verb(
        "stages",
        blocks={"count": rig.block("count.count"), "later": rig.block("memory.memory")},
        instantiation_parameters={"y": "count.y", "z": "later.keeps"},
        input_parameters={"limit": gpac.input("count.enough", default=1e9)},
        command_lists={"one": [activate("count", every="1 ms")], "two": [execute("later")]},
        initial="one",
        conditions={"enough": gpac.on("count.enough")},
        transitions={("one", "enough"): "two"},
    )
    svvs = rig.svvs("y1", "z1", "y2", "z2")
    first, second = (verb.on(rig.fast).new_instance(*svvs[at : at + 2]) for at in (0, 2))
    for instance in (first, second):
        held = [(block["label"], block["block"]) for block in instance._about()["blocks"]]
        assert held == [("count", "count.count"), ("later", "memory.memory")] and instance.state == "created"
    for round_ in (1, 2, 3):
        first.start(limit=2 + round_)
        assert first.wait().condition == "completed"
    second.start(limit=1)
    second.wait()
    y1, z1, y2, z2 = (svv.value for svv in svvs)
    assert (z1, z2) == (3, 1) and y1 >= 5 and y2 >= 1, "the state that one keeps is not the other's"


def test_r099_several_instances_of_one_verb_are_active(rig: Rig) -> None:
    counting, svvs = rig.counting(), rig.svvs("a", "b")
    instances = [counting.on(rig.fast).asynch(svv) for svv in svvs]
    assert instances[0].name != instances[1].name
    assert all(vi.state == "running" for vi in instances)


def test_r100_start_suspend_resume_halt(rig: Rig) -> None:
    (a,) = rig.svvs("a")
    vi = rig.counting().on(rig.fast).new_instance(a)
    vi.start()
    rig.cell.advance("5 ms")
    vi.suspend()
    held = a.value
    assert vi.state == "suspended"
    rig.cell.advance("20 ms")
    assert a.value == held
    vi.resume()
    rig.cell.advance("5 ms")
    assert a.value > held and vi.state == "running"
    vi.halt()
    assert vi.state == "ended" and vi.wait().condition == "halted"


def test_r100_running_time_stands_still_while_suspended(rig: Rig) -> None:
    time, now = rig.cell.svv("time", "int64_t"), rig.cell.svv("now", "int64_t")
    telling = gpac.Verb(
        "telling",
        blocks={"c": rig.block("count.clock_now")},
        instantiation_parameters={"time": "c.time_ns", "now": "c.now_ns"},
        command_lists={"start": [gpac.activate("c", every="1 ms")]},
    )
    vi = telling.on(rig.fast).asynch(time, now)
    rig.cell.advance("10 ms")
    vi.suspend()
    rig.cell.advance("100 ms")
    vi.resume()
    rig.cell.advance("10 ms")
    assert time.value < 30_000_000 < 100_000_000 < now.value


def test_r101_commands_go_to_the_real_time_system(rig: Rig) -> None:
    """The supervisor records and executes each command; one that it refuses changes nothing."""
    a, b = rig.svvs("a", "b")
    vi, other = (rig.counting().on(rig.fast).named(name).new_instance(svv) for name, svv in (("mine", a), ("other", b)))

    def state(name: str) -> str:
        return next(entry.state for entry in rig.cell.instances if entry.name == name)

    for refused in (other.resume, other.suspend):
        with pytest.raises(gpac.InvalidState):
            refused()
        assert state("other") == "created"
    expected = []
    for command, then in ((vi.start, "running"), (vi.suspend, "suspended"), (vi.resume, "running"), (vi.halt, "ended")):
        command()
        assert state("mine") == then == vi.state, "as the real-time system has it"
        expected.append(command.__name__)
    log = [entry for entry in rig.cell.log() if entry["about"] == "mine"]
    assert [entry["text"] for entry in log if entry["kind"] == "command"] == expected
    assert [entry["kind"] for entry in log if entry["kind"] != "command"] == ["start", "end"]
    vi.delete()
    assert rig.cell.names["instances"] == ["other"]


def test_r101_they_come_from_another_process(tmp_path: Path) -> None:
    """A real-time system in its own process continues its commands after the programming system has exited."""
    daemon = Daemon(tmp_path, "monotonic")
    try:
        with gpac.connect(daemon.url, name="first") as far:
            fast = far.processor("rtp0").timer("fast", period="1 ms", priority=80)
            wave = gpac.Verb(
                "wave",
                blocks={"wave": gpac.library.block("signal_generator")(shape=1, frequency=1.0)},
                instantiation_parameters={"y": "wave.y"},
                command_lists={"start": [activate("wave", every="1 ms")]},
            )
            y = far.svv("y")
            wave.on(fast).named("mine").asynch(y)
            number = until(lambda: y.number, "it runs")
        with gpac.connect(daemon.url, name="second") as far:
            vi, y = far.instance("mine"), far.svv("y")
            assert vi.state == "running"
            until(lambda: y.number > number, "it has gone on")
            vi.halt()
            assert {entry.name: entry.state for entry in far.instances} == {"mine": "ended"}
    finally:
        daemon.stop()


def test_r102_one_processor_is_the_supervisor(rig: Rig) -> None:
    rig.cell.processor("other")
    assert rig.cell.names["supervisor"] == "rtp0", "the first one"
    (a,) = rig.svvs("a")
    assert rig.counting().on(rig.fast)(a, limit=2).last == 2, "it runs applications too"


def test_r103_the_supervisor_answers_while_verbs_run(rig: Rig) -> None:
    (a,) = rig.svvs("a")
    vi = rig.counting().on(rig.fast).asynch(a)
    rig.cell.advance("3 ms")
    assert vi.state == "running" and rig.cell.statistics["sources"]["rtp0.fast"]["firings"] >= 3


def test_r104_every_end_is_reported(rig: Rig) -> None:
    (a,) = rig.svvs("a")
    vi = rig.counting().on(rig.fast).new_instance(a)
    for number in range(5):
        vi.start(limit=number + 1)
        report = vi.wait()
        assert report.last == number + 1
    assert vi.report is report


def test_r105_every_processor_has_a_kernel(rig: Rig) -> None:
    timers = [rig.cell.processor(f"p{n}").timer("t", period="1 ms", priority=50) for n in range(2)]
    svvs = rig.svvs("a", "b")
    for timer, svv in zip(timers, svvs, strict=True):
        rig.counting().on(timer).asynch(svv)
    rig.cell.advance("3 ms")
    sources = rig.cell.statistics["sources"]
    assert all(sources[timer.name]["firings"] >= 3 for timer in timers)


def test_r106_the_supervisor_installs_everywhere(rig: Rig) -> None:
    elsewhere = rig.cell.processor("p1").timer("t", period="1 ms", priority=50)
    (a,) = rig.svvs("a")
    assert rig.counting().on(elsewhere)(a, limit=3).last == 3


def test_r107_creation_reports_completion(rig: Rig) -> None:
    """When creation has returned, everything is allocated, on other processors too; a start finds it ready, and only then does anything
    run."""
    there = rig.cell.processor("rtp1").timer("there", period="1 ms", priority=50)
    (a,) = rig.svvs("a")
    vi = rig.counting().on(there).named("mine").new_instance(a)
    assert (vi.name, vi.state) == ("mine", "created")
    assert [(entry.name, entry.verb, entry.state) for entry in rig.cell.instances] == [("mine", "counting", "created")]
    assert [block["source"] for block in vi._about()["blocks"]] == ["rtp1.there"]
    with pytest.raises(gpac.InvalidState, match="bound by 'mine'"):
        a.delete()
    assert (a.value, a.number) == (0, 0)
    vi.start(limit=3)
    assert vi.wait().last == 3


def test_r107_a_creation_that_fails_is_reported_and_has_allocated_nothing(rig: Rig) -> None:
    (a,) = rig.svvs("a")
    wrong = rig.cell.svv("wrong", "int32_t")
    counting = rig.counting().on(rig.fast)
    with pytest.raises(gpac.TypeMismatch):
        counting.named("mine").new_instance(wrong)
    assert not rig.cell.instances
    wrong.delete()
    taken = counting.named("mine").new_instance(a)
    with pytest.raises(gpac.Error, match="mine"):
        counting.named("mine").new_instance(a)
    assert [entry.name for entry in rig.cell.instances] == ["mine"] and taken.state == "created"


def test_r108_an_instance_runs_until_something_ends_it(rig: Rig) -> None:
    (a,) = rig.svvs("a")
    vi = rig.counting().on(rig.fast).asynch(a)
    rig.cell.advance("2 s")
    assert vi.state == "running" and a.value == 1999


def test_r109_the_reason_decides_about_an_exception(rig: Rig) -> None:
    class Enough(gpac.Terminated):
        pass

    (a,) = rig.svvs("a")
    raising = rig.counting("raising", conditions={"enough": gpac.on("count.enough", returns=["last"], raises=Enough)})
    with pytest.raises(Enough) as caught:
        raising.on(rig.fast)(a, limit=3)
    error = caught.value
    assert (error.verb, error.condition, error.command_list, error.block, error.value) == ("raising", "enough", "start", "count", 3)
    assert error.outputs == {"last": 3} and error.report.last == 3 and error.time > 0
    assert "rig.py:" in str(error), "where the verb was defined"


def test_r110_delete_frees_everything(rig: Rig) -> None:
    (a,) = rig.svvs("a")
    counting = rig.counting().on(rig.fast)
    before, steps = rig.cell.names, rig.cell.statistics["sources"]["rtp0.fast"]["steps"]
    for _ in range(200):
        counting(a, limit=1)
    assert rig.cell.names == {**before, "verbs": ["counting"]}
    assert rig.cell.statistics["sources"]["rtp0.fast"]["steps"] == steps
    vi = counting.new_instance(a)
    vi.delete()
    assert vi.state == "deleted"
    with pytest.raises(gpac.InvalidState, match="deleted"):
        vi.start()
    a.delete()


CYCLES = int(os.environ.get("OPENGPAC_CYCLES", "10000"))
"""Number of cycles; `make faults` runs the 100,000 of the requirement."""


def test_r110_instances_leave_no_memory_behind(memory_rig: Rig) -> None:
    """Uses the real-time system's own create and delete: the process's memory returns to its former size."""
    (a,) = memory_rig.svvs("a")
    counting = memory_rig.counting().on(memory_rig.fast)
    real_time_system = memory_rig.cell._alive()
    given = application_json(counting, counting.arguments_signature.bind(a))

    def cycles(count: int) -> int:
        for _ in range(count):
            real_time_system.delete(real_time_system.create(given))
        return resident_kb(os.getpid())

    counting(a, limit=1)
    before = cycles(3_000)
    grown_kb = cycles(CYCLES) - before
    assert grown_kb < 256, "not even 26 bytes of an instance: the smallest allocation takes 32"
    kept = [real_time_system.create(given) for _ in range(2_000)]
    assert resident_kb(os.getpid()) - before - grown_kb > 256, "what is not deleted is seen"
    for identity in kept:
        real_time_system.delete(identity)
    assert not memory_rig.cell.instances


def test_r102_a_second_supervisor_is_refused() -> None:
    with gpac.System("two", clock="virtual") as cell:
        cell.processor("rtp0")
        cell.processor("rtp1", supervisor=True)
        assert cell.names["supervisor"] == "rtp1"
        with pytest.raises(gpac.InUse, match="rtp1"):
            cell.processor("rtp2", supervisor=True)
