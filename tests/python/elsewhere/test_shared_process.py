# SPDX-License-Identifier: Apache-2.0
"""Several processors in one process: each has its own sources, and the end of the process ends all of them."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from typing import Any

import pytest

import opengpac as gpac
from afar import Afar, Guarded, children, processor_time_s, pushing, shared_memory, until
from cell_rig import channel
from opengpac import activate, library

pytestmark = pytest.mark.alone

PROCESS = "cell-a"


class Sharing(Afar):
    """System with `rtp1` and `rtp2` in the process `cell-a`: `there` and `beside`, timers of 2 ms."""

    def __init__(self, cell: gpac.System, built: dict[str, str]) -> None:
        super().__init__(cell, built, PROCESS)
        self.rtp2 = cell.processor("rtp2", process=PROCESS)
        self.beside = self.rtp2.timer("fast", period="2 ms", priority=70)

    def counts_on(self, *names: str) -> None:
        """Checks that both count again, in SVVs of these names."""
        for name, source in zip(names, (self.there, self.beside), strict=True):
            assert self.counting().on(source)(self.cell.svv(name), limit=5, time_limit="60 s").last == 5


@pytest.fixture
def sharing(built: dict[str, str]) -> Iterator[Sharing]:
    """Yields a system with a processor here and two in one process."""
    with gpac.System("sharing", progress=False) as cell:
        yield Sharing(cell, built)


def configured(cell: gpac.System) -> dict[str, Any]:
    return cell._alive().configuration()


def test_they_share_one_process_and_it_is_to_be_seen(sharing: Sharing) -> None:
    sharing.counts_on("one", "other")
    assert len(children("run_processor")) == 1
    sharing.cell.processor("rtp3", process=True)
    assert len(children("run_processor")) == 2, "its own is another one"
    processes = {PROCESS: ["rtp1", "rtp2"], "rtp3": ["rtp3"]}
    assert sharing.cell.statistics["processes"] == processes
    assert sharing.cell._alive().names()["processes"] == processes
    shown = {name: about["process"] for name, about in configured(sharing.cell)["processors"].items()}
    assert shown == {"rtp0": None, "rtp1": PROCESS, "rtp2": PROCESS, "rtp3": "rtp3"}


def test_synchronous_values_and_histories_between_them_and_out_of_them(sharing: Sharing) -> None:
    soft, back = sharing.rtp2.software("soft", priority=60), sharing.rtp0.software("soft", priority=60)
    verb = gpac.Verb(
        "chain",
        blocks={"count": sharing.block("count.count"), "twice": library.gain(k=2.0), "thrice": library.gain(k=3.0)},
        instantiation_parameters={"y": "thrice.y", "between": ["twice.y", "thrice.u"], "first": ["count.y", "twice.u"]},
        command_lists={"start": [activate("thrice"), activate("twice"), activate("count", every="2 ms")]},
    )
    y, between, first = (sharing.cell.svv(name, history=500) for name in ("y", "between", "first"))
    verb.on({"count": sharing.there, "twice": soft, "thrice": back}).asynch(y=y, between=between, first=first)
    until(lambda: y.value >= 6 * 200, "values come all the way")
    for svv, factor in ((first, 1), (between, 2), (y, 6)):
        values = [int(row["value"]) for row in svv.history[:]]
        assert values == [factor * (values[0] // factor + step) for step in range(len(values))], f"each once and in order: {svv.name}"


def test_a_transition_of_a_verb_with_blocks_on_both(sharing: Sharing) -> None:
    one, other = sharing.cell.svv("one"), sharing.cell.svv("other")
    verb = gpac.Verb(
        "both",
        blocks={"a": sharing.block("count.count"), "b": sharing.block("count.count")},
        instantiation_parameters={"one": "a.y", "other": "b.y"},
        input_parameters={"limit": "a.enough"},
        command_lists={"start": [activate("b", every="2 ms"), activate("a", every="2 ms")], "then": [activate("b", every="2 ms")]},
        conditions={"enough": gpac.on("a.enough")},
        transitions={("start", "enough"): "then"},
        initial="start",
    )
    instance = verb.on({"a": sharing.there, "b": sharing.beside}).asynch(one, other, limit=5)
    until(lambda: [i["list"] for i in sharing.cell.statistics["instances"] if i["name"] == instance.name] == ["then"], "it is there")
    stays = one.value
    assert stays >= 5, "it went on until the supervisor had answered"
    sharing.goes_on(other)
    assert one.value == stays


def test_a_killed_process_takes_both_and_a_reset_brings_both_back(sharing: Sharing) -> None:
    near = sharing.cell.svv("near")
    sharing.counting().on(sharing.here).asynch(near)
    ys = [sharing.cell.svv("y1"), sharing.cell.svv("y2")]
    doomed = [sharing.counting().on(source).asynch(y) for y, source in zip(ys, (sharing.there, sharing.beside), strict=True)]
    until(lambda: all(y.value > 3 for y in ys), "both run there")
    killed = sharing.process()
    sharing.end()
    for number, instance in enumerate(doomed, 1):
        with pytest.raises(
            gpac.Terminated, match=rf"processor 'rtp{number}' was lost with process 'cell-a': its process was ended by SIGKILL"
        ) as caught:
            instance.wait()
        assert caught.value.condition == "processor_lost"
    sharing.goes_on(near)
    assert [entry["about"] for entry in sharing.log("processor_lost")] == ["rtp1.fast", "rtp2.fast"]
    assert [entry["about"] for entry in sharing.log("guard")] == [PROCESS], "the guard has one process"
    with pytest.raises(
        gpac.InvalidState, match=r"processor 'rtp3': its process 'cell-a', which processor 'rtp1' uses too, is lost.*reset\(\)"
    ):
        sharing.cell.processor("rtp3", process=PROCESS)
    sharing.cell.reset()
    assert sharing.process() != killed
    sharing.counts_on("again1", "again2")


def test_the_message_of_each_names_the_block_that_ran(sharing: Sharing) -> None:
    beside = sharing.counting().on(sharing.beside).asynch(sharing.cell.svv("beside"))
    stays = sharing.failing("endings.stays", budget="1000 s").on(sharing.there).asynch(sharing.cell.svv("y"))
    process = sharing.process()
    before = processor_time_s(process)
    until(lambda: processor_time_s(process) > before + 0.5, "it is in the invocation that does not return")
    sharing.end()
    for instance in (stays, beside):
        with pytest.raises(gpac.Terminated, match=r"SIGKILL.*it was running block '") as caught:
            instance.wait()
        assert caught.value.condition == "processor_lost"
    assert "block 'bad'" in next(entry["text"] for entry in sharing.log("processor_lost") if entry["about"] == "rtp1.fast")


def test_an_abort_in_one_is_told_of_the_other_with_its_block(sharing: Sharing) -> None:
    idle = sharing.rtp2.software("soft", priority=60)
    waits = gpac.Verb(
        "waits",
        blocks={"gain": library.gain(k=1.0)},
        instantiation_parameters={"u": "gain.u", "y": "gain.y"},
        modes={"gain.u": "asynchronous"},
        command_lists={"start": [activate("gain")]},
    )
    waiting = waits.on(idle).asynch(sharing.cell.svv("never"), sharing.cell.svv("out"))
    with pytest.raises(gpac.Terminated, match=r"SIGABRT.*it was running block 'bad' of 'failing_aborts#1'"):
        sharing.failing("endings.aborts").on(sharing.there)(sharing.cell.svv("y"), time_limit="60 s")
    with pytest.raises(gpac.Terminated, match=r"'rtp2' was lost with process 'cell-a'.*SIGABRT.*it was running block 'bad' of 'failing_a"):
        waiting.wait()


def test_a_fault_in_one_is_nothing_to_the_other(sharing: Sharing) -> None:
    beside = sharing.cell.svv("beside")
    sharing.counting().on(sharing.beside).asynch(beside)
    with pytest.raises(gpac.Terminated) as caught:
        sharing.failing("faults.divides").on(sharing.there)(sharing.cell.svv("y"), time_limit="60 s")
    assert caught.value.condition == "fault"
    sharing.goes_on(beside)


@pytest.mark.parametrize("by", [signal.SIGKILL, signal.SIGSTOP])
def test_the_outputs_of_both_are_safe_when_the_process_ends(sharing: Sharing, by: signal.Signals) -> None:
    plants = [
        Guarded(sharing, rtp, source, number)
        for number, (rtp, source) in enumerate(((sharing.rtp1, sharing.there), (sharing.rtp2, sharing.beside)))
    ]
    for plant in plants:
        pushing.on(plant.source).asynch(plant.device["x"].effort, u=1.0)
    until(lambda: not any(plant.state()["is_safe"] for plant in plants), "both plants are pushed")
    sharing.end(by)
    until(lambda: all(plant.state()["is_safe"] for plant in plants), "both plants are safe")
    until(lambda: len(sharing.log("processor_lost")) == 2, "both are lost")
    sharing.cell.reset()
    for plant in plants:
        pushing.on(plant.source).asynch(plant.device["x"].effort, u=1.0)
    until(lambda: not any(plant.state()["is_safe"] for plant in plants), "both are pushed again")


def test_an_emergency_stop_that_one_reads_stops_the_other(sharing: Sharing) -> None:
    signals = sharing.rtp1.physical_device(
        "signals", gpac.drivers.scripted([channel("set", "write"), channel("stop", loop_of="set")]), exchange=sharing.there
    )
    drives = sharing.rtp2.physical_device("drives", gpac.drivers.loopback("x"), exchange=sharing.beside)
    sharing.cell.emergency_stop_input(signals["stop"])
    pushed = pushing.on(sharing.beside).asynch(drives["x"].effort, u=1.0)
    setting = gpac.Verb(
        "setting",
        blocks={"set": library.set_digital, "write": library.write_digital},
        instantiation_parameters={"channel": "write.channel"},
        input_parameters={"on": "set.value"},
        cells={"c": ["set.y", "write.u"]},
        command_lists={"start": [activate("set", every="2 ms"), activate("write", every="2 ms")]},
    )
    setting.on(sharing.there).asynch(channel=signals["set"], on=True)
    with pytest.raises(gpac.Terminated, match=r"emergency_stop.*signals\.stop"):
        pushed.wait()


def test_a_restart_counts_once_for_all_of_them(sharing: Sharing) -> None:
    for _ in range(11):
        sharing.end()
        until(lambda: len(children("run_processor")) == 0, "it has ended")
        until(lambda: sharing.cell.statistics["sources"]["rtp2.fast"] and _resets(sharing), "11 new processes are not 22")
    sharing.counts_on("again1", "again2")


def _resets(sharing: Sharing) -> bool:
    """Returns whether the loss was noticed and a new process has been started."""
    sharing.cell.reset()
    return len(children("run_processor")) == 1


def test_close_leaves_nothing(built: dict[str, str]) -> None:
    with gpac.System("shared_and_closed", progress=False) as cell:
        sharing = Sharing(cell, built)
        for number, source in enumerate((sharing.here, sharing.there, sharing.beside)):
            sharing.counting().on(source).asynch(cell.svv(f"y{number}"))
    until(lambda: not children("run_processor") and not children("run_guard"), "no child is left")
    assert shared_memory("shared_and_closed") == []


@pytest.mark.parametrize("name", ["", " ", "cell a", "cell/a", "-a", "a" * 65])
def test_a_name_that_is_none_is_refused(name: str) -> None:
    with gpac.System("refused", clock="virtual") as cell:
        with pytest.raises(gpac.DefinitionError, match=r"processor 'rtp1' is to run in process .*, which is not a valid name; use letters"):
            cell.processor("rtp1", process=name)
        cell.processor("rtp1", process="cell-a")


def test_contradictions_are_refused() -> None:
    with gpac.System("refused", clock="virtual") as cell:
        with pytest.raises(gpac.PlacementError, match="processor 'rtp1' is to run both in process 'cell-a' and on host 'cell-b'"):
            cell.processor("rtp1", process="cell-a", host="cell-b")
        cell.processor("rtp1", process=True)
        with pytest.raises(
            gpac.InUse, match="'rtp1' has its own process, which is called 'rtp1', but processor 'rtp2' names that process too"
        ):
            cell.processor("rtp2", process="rtp1")
        cell.processor("rtp2", process="rtp3")
        with pytest.raises(
            gpac.InUse, match="'rtp3' has its own process, which is called 'rtp3', but processor 'rtp2' names that process too"
        ):
            cell.processor("rtp3", process=True)
        with pytest.raises(gpac.PlacementError, match="supervisor"):
            gpac.System("real", progress=False).processor("rtp1", supervisor=True, process="cell-a")
        with pytest.raises(TypeError):
            cell.processor("rtp4", process=4)  # type: ignore[arg-type]
        assert cell.statistics["processes"] == {"rtp1": ["rtp1"], "rtp3": ["rtp2"]}


def test_under_the_virtual_clock_they_are_in_the_one_thread(built: dict[str, str]) -> None:
    with gpac.System("virtual", clock="virtual") as cell:
        sharing = Sharing(cell, built)
        sharing.counts_on("one", "other")
        assert children("run_processor") == [] and cell.statistics["processes"] == {PROCESS: ["rtp1", "rtp2"]}
        assert cell.take_over().processors == ()
