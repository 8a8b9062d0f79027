# SPDX-License-Identifier: Apache-2.0
"""A supervisor is killed, and another one adopts the running instances in a processor's process: nothing moves, nothing is left over."""

from __future__ import annotations

import itertools
import os
import signal
from collections.abc import Iterator

import pytest

import opengpac as gpac
from afar import shared_memory, until
from opengpac.system import open_systems
from orphans import HOLDS, LEVEL, Orphaned, go, lives

pytestmark = pytest.mark.alone

numbers = itertools.count()


@pytest.fixture
def orphaned(built: dict[str, str]) -> Iterator[Orphaned]:
    """Yields a system whose programs are killed; checks that nothing of it is left over."""
    made = Orphaned(f"orphan-{os.getpid()}-{next(numbers)}", built)
    yield made
    made.close()
    until(lambda: not any(map(lives, (made.process, *made.guards))), "no process is left over")
    until(lambda: not shared_memory(made.name) and not made.sockets(), "nothing is left over")


def test_a_new_supervisor_takes_over_and_the_joint_does_not_move(orphaned: Orphaned) -> None:
    first = orphaned.begin()
    assert orphaned.held()
    orphaned.kill(first)
    assert orphaned.held(), "the servo goes on without a supervisor"
    cell = orphaned.cell()
    with cell.system as system:
        cell.joint.enable()
        keeping = cell.keeping(1.0)
        assert cell.joint.sensed.value == pytest.approx(HOLDS, abs=0.01), "it sees where the joint is"
        until(lambda: cell.level.value == 1.0, "its own blocks run, and began anew")
        assert orphaned.held(), "and nothing of it reaches the drive"
        taken = system.take_over()
        of = taken["rtp1"]
        assert taken.adopted == ("rtp1",) and of.anew == {} and of.ended == ()
        assert f"{keeping.name}.kept" in of.carried and of.gap is not None
        assert "blocks continue; outputs held for" in str(taken)
        assert orphaned.held(), "it goes on where the one before stopped"
        until(lambda: cell.level.value == LEVEL, "the other block too")
        assert cell.joint.commanded.value == pytest.approx(HOLDS)
        assert orphaned.process and lives(orphaned.process), "the process is the same"
        cell.goes(0.2)
        until(lambda: abs(orphaned.look() - 0.2) < 0.01, "the joint follows the new supervisor")
        assert not system.take_over()["rtp1"].adopted, "once is enough"
    until(lambda: not lives(orphaned.process), "it ends with the system that took it over")


@pytest.mark.parametrize("second", ["cell-a", "own"])
def test_two_connected_processors_are_taken_over_in_one_process_and_in_two(built: dict[str, str], second: str) -> None:
    orphaned = Orphaned(f"orphan-{os.getpid()}-{next(numbers)}", built, second)
    orphaned.kill(orphaned.begin())
    assert orphaned.held() and len(orphaned.others) == (second == "own")
    cell = orphaned.cell()
    with cell.system as system:
        cell.joint.enable()
        cell.keeping(1.0)
        chain = cell.chain().name
        taken = system.take_over()
        assert taken.adopted == ("rtp1", "rtp2") and len(taken.processors) == 1 + len(orphaned.others)
        assert all(of.anew == {} and of.ended == () for of in taken.processors), taken
        assert f"{chain}.count" in taken["rtp1"].carried and f"{chain}.twice" in taken["rtp2"].carried
        assert ("process 'cell-a' (processors 'rtp1', 'rtp2'): " in str(taken)) == (second == "cell-a")
        assert orphaned.held(), "the joint does not move"
        first = cell.doubled.value
        until(lambda: cell.doubled.value >= first + 2 * 300, "the chain goes on")
        values = [int(row["value"]) for row in cell.doubled.history[:]]
        assert values == list(range(values[0], values[0] + 2 * len(values), 2)), "each number once and in order"
    orphaned.close()
    until(lambda: not any(lives(pid) for pid in (orphaned.process, *orphaned.others, *orphaned.guards)), "no process is left over")
    until(lambda: not shared_memory(orphaned.name) and not orphaned.sockets(), "nothing is left over")


def test_a_successor_that_dies_before_it_took_over_changes_nothing(orphaned: Orphaned) -> None:
    first, second = orphaned.begin(), orphaned.program("adopts")
    orphaned.kill(first)
    go(second, "adopts")
    assert orphaned.held()
    orphaned.kill(second)
    assert orphaned.held()
    cell = orphaned.cell()
    with cell.system as system:
        cell.joint.enable()
        cell.keeping(1.0)
        assert system.take_over().adopted == ("rtp1",)
        assert orphaned.held()
        until(lambda: cell.level.value == LEVEL, "what the first one began goes on")


def test_one_that_is_closed_before_it_took_over_leaves_what_runs(orphaned: Orphaned) -> None:
    orphaned.kill(orphaned.begin())
    with orphaned.cell().system:
        pass
    assert orphaned.held() and lives(orphaned.process)
    cell = orphaned.cell()
    with cell.system as system:
        cell.joint.enable()
        [of] = system.take_over().processors
        assert [block.partition(".")[2] for block in of.ended] == ["kept"], "what was not started again has ended"
        assert orphaned.held()


def test_what_was_taken_over_is_an_orphan_again_when_that_supervisor_dies(orphaned: Orphaned) -> None:
    first, second = orphaned.begin(), orphaned.program("takes")
    orphaned.kill(first)
    go(second, "takes")
    assert orphaned.held()
    orphaned.kill(second)
    assert orphaned.held(), "the farewell of its servo is to go on"
    cell = orphaned.cell()
    with cell.system as system:
        cell.joint.enable()
        cell.keeping(1.0)
        assert system.take_over()["rtp1"].anew == {}
        assert orphaned.held()
        until(lambda: cell.level.value == LEVEL, "what the first one began went through two hands")


def test_a_block_with_another_face_begins_anew_and_is_named(orphaned: Orphaned) -> None:
    orphaned.kill(orphaned.begin())
    cell = orphaned.cell()
    with cell.system as system:
        cell.joint.enable()
        block = f"{cell.counting().name}.kept"
        of = system.take_over()["rtp1"]
        assert list(of.anew) == [block] and "items" in of.anew[block]
        assert f"{block} starts from its initial state" in str(of)
        assert orphaned.held()


def test_the_second_of_two_successors_is_refused(orphaned: Orphaned) -> None:
    first, second = orphaned.begin(), orphaned.program("adopts")
    with pytest.raises(gpac.InvalidState, match=r"processor 'rtp1'.*its system is still there and commands it"):
        orphaned.cell()
    orphaned.kill(first)
    go(second, "adopts")
    with pytest.raises(gpac.InvalidState, match=r"processor 'rtp1'.*another system is already taking it over"):
        orphaned.cell()
    assert orphaned.held()
    orphaned.kill(second)
    with orphaned.cell().system as system:
        system.take_over()


def test_a_device_that_is_opened_otherwise_is_refused(orphaned: Orphaned) -> None:
    orphaned.kill(orphaned.begin())
    with pytest.raises(gpac.DeviceFailed, match=r"device 'drives' runs there with driver 'plant_process'.*open it as before"):
        orphaned.cell(linger="11 s")
    open_systems.close_last(orphaned.name)
    assert orphaned.held()
    with orphaned.cell().system as system:
        assert system.take_over().adopted == ("rtp1",)


@pytest.mark.parametrize("gone", [[], [0], [1], [0, 1]], ids=["both live", "second lives", "first lives", "both are gone"])
def test_the_outputs_are_guarded_by_the_guards_before_or_by_others(orphaned: Orphaned, gone: list[int]) -> None:
    orphaned.kill(orphaned.begin())
    for guard in gone:
        os.kill(orphaned.guards[guard], signal.SIGKILL)
        until(lambda guard=guard: not lives(orphaned.guards[guard]), "the guard is gone")
    cell = orphaned.cell()
    with cell.system as system:
        cell.joint.enable()
        system.take_over()
        assert orphaned.held() and [lives(guard) for guard in orphaned.guards] == [number not in gone for number in range(2)]
        os.kill(orphaned.process, signal.SIGKILL)
        until(orphaned.is_safe, "the outputs are safe")
        until(lambda: "processor_lost" in system.alarms, "and the loss is told")


def test_a_device_that_is_not_opened_again_is_closed(orphaned: Orphaned) -> None:
    orphaned.kill(orphaned.begin())
    with gpac.System(orphaned.name, progress=False, adopt=True) as system:
        system.processor("rtp1", process=True).timer("fast", period="1 ms")
        assert orphaned.held()
        of = system.take_over()["rtp1"]
        assert of.carried == () and of.gap is None and any(block.startswith("axis") for block in of.ended)
        until(lambda: not orphaned.there(), "its driver has closed it")


def test_where_nothing_waits_a_process_is_started_and_that_is_said(built: dict[str, str]) -> None:
    with gpac.System("nobody-waits", progress=False, adopt=True) as cell:
        cell.processor("rtp1", process=True).timer("fast", period="2 ms")
        taken = cell.take_over()
        assert taken.adopted == () and str(taken) == "processor 'rtp1': its process was started for this system"
        assert [entry["text"] for entry in cell.log() if entry["about"] == "rtp1"] == [
            "none of its processes waits for a new supervisor: a new process is started"
        ]


def test_under_the_virtual_clock_there_is_nothing_to_take_over() -> None:
    with gpac.System("virtual", clock="virtual", adopt=True) as cell:
        cell.processor("rtp1", process=True).timer("fast", period="2 ms")
        taken = cell.take_over()
        assert taken.adopted == () and "nothing to take over" in str(taken)
