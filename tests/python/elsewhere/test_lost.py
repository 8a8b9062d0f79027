# SPDX-License-Identifier: Apache-2.0
"""The process of a processor ends: its verbs end with `processor_lost`, the others continue, and a reset restarts it."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

import opengpac as gpac
from afar import Afar, children, processor_time_s, until
from opengpac import activate, on

pytestmark = pytest.mark.alone


def test_a_killed_process_is_lost_and_comes_back_with_a_reset(afar: Afar) -> None:
    near, far = afar.cell.svv("near"), afar.cell.svv("far")
    going_on = afar.counting().on(afar.here).asynch(near)
    doomed = afar.counting().on(afar.there).asynch(far)
    until(lambda: far.value > 3, "it runs there")
    killed = afar.process()
    afar.end()
    with pytest.raises(gpac.Terminated, match=r"processor 'rtp1' was lost: its process was ended by SIGKILL") as caught:
        doomed.wait()
    assert caught.value.condition == "processor_lost"
    assert going_on.state == "running"
    afar.goes_on(near)
    with pytest.raises(gpac.Error, match="rtp1"):
        afar.counting().on(afar.there).new_instance(far)
    assert [entry["about"] for entry in afar.log("processor_lost")] == ["rtp1.fast"]
    assert "processor_lost" in afar.cell.alarms
    afar.cell.reset()
    assert afar.process() != killed
    assert afar.counting().on(afar.there)(far, limit=5, time_limit="60 s").last == 5 == far.value
    assert going_on.state == "running", "the reset is nothing to those that were not lost"
    afar.goes_on(near)


def test_a_transition_leads_to_a_list_on_the_processors_that_are_left(afar: Afar) -> None:
    lists = {"start": [activate("count", every="2 ms")], "after": [activate("retreat", every="2 ms")]}
    counting = afar.counting(
        "guarded",
        blocks={"count": afar.block("count.count"), "retreat": afar.block("count.count")},
        instantiation_parameters={"y": "count.y", "z": "retreat.y"},
        input_parameters={"limit": "retreat.enough"},
        output_values={"last": "retreat.y"},
        command_lists=lists,
        initial="start",
        conditions={"enough": on("retreat.enough", returns=["last"])},
        transitions={("start", "processor_lost"): "after"},
    )
    assert ("start", "processor_lost", "→ after if it runs on a remaining processor") in counting.table()
    y, z, far = (afar.cell.svv(name) for name in ("y", "z", "far"))
    going_on = counting.on({"count": afar.there, "retreat": afar.here}).asynch(y, z, limit=3)
    lost = counting.on(afar.there).asynch(far, afar.cell.svv("w"), limit=3)
    until(lambda: y.value > 3 and far.value > 3, "both run there")
    afar.end()
    report = going_on.wait(timeout="60 s")
    assert (report.condition, report.command_list, report.last, z.value) == ("enough", "after", 3, 3)
    with pytest.raises(gpac.Terminated, match=r"command list 'after' cannot follow: it runs on 'rtp1\.fast', which is lost too") as caught:
        lost.wait(timeout="60 s")
    assert (caught.value.condition, caught.value.command_list) == ("processor_lost", "start")
    afar.cell.reset()
    again = counting.on({"count": afar.there, "retreat": afar.here}).asynch(afar.cell.svv("again"), afar.cell.svv("anew"), limit=3)
    again.halt()


def test_an_idle_instance_there_is_started_again_after_a_reset(afar: Afar) -> None:
    idle = afar.counting().on(afar.there).new_instance(afar.cell.svv("far"))
    assert idle.start(limit=3, time_limit="60 s").wait().last == 3
    afar.end()
    until(lambda: afar.log("processor_lost"), "it is lost")
    with pytest.raises(gpac.InvalidState, match=r"rtp1\.fast' (is lost|does not answer).*reset\(\)"):
        idle.start()
    afar.cell.reset()
    assert idle.start(limit=5, time_limit="60 s").wait().last == 5


def test_what_was_lost_and_not_waited_for_does_not_hinder_a_reset(afar: Afar) -> None:
    far = afar.cell.svv("far")
    lost = afar.counting().on(afar.there).asynch(far)
    until(lambda: far.value > 3, "it runs there")
    afar.end()
    until(lambda: lost.done, "it is lost")
    with pytest.raises(gpac.InvalidState, match=r"cannot read SVV 'far': source 'rtp1\.fast', which writes it, is lost.*reset\(\)"):
        _ = far.value
    with pytest.raises(gpac.InvalidState, match=r"cannot create.*'rtp1\.fast' is lost.*reset\(\)"):
        afar.counting().on(afar.there).new_instance(afar.cell.svv("other"))
    afar.cell.reset()
    assert afar.counting().on(afar.there)(afar.cell.svv("again"), limit=5, time_limit="60 s").last == 5


def test_the_message_names_the_block_that_ran(afar: Afar) -> None:
    instance = afar.failing("endings.stays", budget="1000 s").on(afar.there).asynch(afar.cell.svv("y"))
    process = afar.process()
    before = processor_time_s(process)
    until(lambda: processor_time_s(process) > before + 0.5, "it is in the invocation that does not return")
    afar.end()
    with pytest.raises(gpac.Terminated, match=r"(SIGKILL|hung).*block 'bad'") as caught:
        instance.wait()
    assert caught.value.condition == "processor_lost"


def test_a_process_whose_timer_does_not_fire_is_ended_and_the_message_says_which_timer(afar: Afar) -> None:
    why = r"hung for 0\.5 s.*: timer 'rtp1\.fast' no longer fired; it was running block 'bad'"
    with pytest.raises(gpac.Terminated, match=why) as caught:
        afar.failing("endings.stays", budget="1000 s").on(afar.there)(afar.cell.svv("y"), time_limit="60 s")
    assert caught.value.condition == "processor_lost"


def scheduled(process: int, thread: str) -> list[tuple[int, int]]:
    """Returns policy and priority of the threads of that name."""
    tasks = [int(task.name) for task in Path(f"/proc/{process}/task").iterdir() if (task / "comm").read_text().strip() == thread]
    return [(os.sched_getscheduler(task) & ~os.SCHED_RESET_ON_FORK, os.sched_getparam(task).sched_priority) for task in tasks]


def test_no_kernel_and_no_other_program_keeps_the_heart_from_beating(afar: Afar) -> None:
    """Otherwise a program that occupies every core for half a second would make the process look frozen, and it would be ended."""
    far = afar.cell.svv("far")
    afar.counting().on(afar.there).asynch(far)
    until(lambda: far.value > 3, "the kernel runs there")
    (kernel,) = scheduled(afar.process(), "rtp1.fast")
    heart = kernel if kernel[0] == os.SCHED_OTHER else (os.SCHED_FIFO, 98)
    until(lambda: scheduled(afar.process(), "heart") == [heart], "so does the heart")


def test_abort_ends_the_process(afar: Afar) -> None:
    near = afar.cell.svv("near")
    afar.counting().on(afar.here).asynch(near)
    with pytest.raises(gpac.Terminated, match="SIGABRT") as caught:
        afar.failing("endings.aborts").on(afar.there)(afar.cell.svv("y"), time_limit="60 s")
    assert caught.value.condition == "processor_lost"
    afar.goes_on(near)


@pytest.mark.parametrize("block", ["divides", "null_pointer", "endless"])
def test_a_signal_in_a_block_is_a_fault_there_as_it_is_here(afar: Afar, block: str) -> None:
    near, y = afar.cell.svv("near"), afar.cell.svv("y")
    afar.counting().on(afar.here).asynch(near)
    process = afar.process()
    with pytest.raises(gpac.Terminated) as caught:
        afar.failing(f"faults.{block}", budget="200 ms").on(afar.there)(y, time_limit="60 s")
    assert (caught.value.condition, caught.value.block) == ("fault", "bad")
    assert afar.cell.statistics["sources"]["rtp1.fast"]["stopped"]
    assert afar.process() == process, "the process is the same"
    afar.goes_on(near)
    afar.cell.reset()
    assert afar.counting().on(afar.there)(afar.cell.svv("again"), limit=5, time_limit="60 s").last == 5
    assert afar.process() == process


def test_a_process_that_is_stopped_is_ended_by_the_guard(afar: Afar) -> None:
    far = afar.cell.svv("far")
    instance = afar.counting().on(afar.there).asynch(far)
    until(lambda: far.value > 3, "it runs there")
    afar.end(signal.SIGSTOP)
    with pytest.raises(gpac.Terminated, match=r"its process was stopped for 0\.1 s \(SIGSTOP, a debugger\), so it was ended") as caught:
        instance.wait()
    assert caught.value.condition == "processor_lost"
    until(lambda: not children("run_processor"), "the stopped process is gone")
    afar.cell.reset()
    assert afar.counting().on(afar.there)(afar.cell.svv("again"), limit=5, time_limit="60 s").last == 5


def test_a_processor_may_be_lost_several_times(afar: Afar) -> None:
    processes = []
    for round in range(3):
        far = afar.cell.svv(f"far_{round}")
        instance = afar.counting().on(afar.there).asynch(far)
        until(lambda far=far: far.value > 3, "it runs there")
        processes.append(afar.process())
        afar.end()
        with pytest.raises(gpac.Terminated, match="SIGKILL"):
            instance.wait()
        afar.cell.reset()
    assert len({*processes, afar.process()}) == 4


def test_how_long_a_process_may_stand_still_is_said_where_it_is_made() -> None:
    with gpac.System("patience", progress=False) as cell:
        is_ended_after_its_bound(cell)
        wrong_bounds_are_refused(cell)


def is_ended_after_its_bound(cell: gpac.System) -> None:
    quick = cell.processor("quick", process=True, lost_after="2 s", patience="60 s").timer("fast", period="2 ms", priority=80)
    sine = gpac.Verb("sine", blocks={"wave": gpac.library.signal_generator}, instantiation_parameters={"y": "wave.y"},
                     command_lists={"start": [gpac.activate("wave", every="2 ms")]}).on(quick).asynch(cell.svv("y"))  # fmt: skip
    (process,) = children("run_processor")
    os.kill(process, signal.SIGSTOP)
    with pytest.raises(gpac.Terminated, match=r"was stopped for 2 s"):
        sine.wait()
    assert [(alarm.code, alarm.source) for alarm in cell.alarms] == [("processor_lost", "quick")]


def wrong_bounds_are_refused(cell: gpac.System) -> None:
    for wrong, what in (
        ({"lost_after": "1 ms"}, r"lost_after of processor 'p' must be 0\.1 s to .* s, not 0\.001 s"),
        ({"patience": "1 s"}, r"patience of processor 'p' must be .* s, not 1 s"),
    ):
        with pytest.raises(gpac.OutOfRange, match=what):
            cell.processor("p", process=True, **wrong)
    with pytest.raises(gpac.PlacementError, match="processor 'p' has patience=, but it runs in threads"):
        cell.processor("p", patience="5 s")
    cell.processor("left", process="both", lost_after="1 s")
    with pytest.raises(gpac.InUse, match=r"processor 'right' shares process 'both', which was created with a different lost_after="):
        cell.processor("right", process="both", lost_after="2 s")
    cell.processor("right", process="both")
