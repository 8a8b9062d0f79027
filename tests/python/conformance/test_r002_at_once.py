# SPDX-License-Identifier: Apache-2.0
"""Requirements 2, 21, 35, 48, 49 and 103 in real time: simultaneous events are observed while they happen."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import opengpac as gpac
from opengpac import activate
from rig import Rig


def verb_of(rig: Rig, label: str, command: gpac.Command) -> gpac.Verb[..., Any]:
    """Returns a verb of one block of `together`; its parameters are the ports of the block."""
    block = rig.block(f"together.{label}")
    ports = [*block.inputs, *block.outputs]
    return gpac.Verb(
        f"one_{label}",
        blocks={label: block},
        instantiation_parameters={port: f"{label}.{port}" for port in ports},
        command_lists={"start": [command]},
    )


def outputs_of(rig: Rig, label: str, prefix: str = "", **given: Any) -> dict[str, Any]:
    """Returns an SVV for each output of a block of `together`, of the port's type, and the values `given` for its inputs."""
    outputs = rig.block(f"together.{label}").outputs
    return {name: rig.cell.svv(f"{prefix or label}.{name}", port.type, history=10) for name, port in outputs.items()} | given


@pytest.mark.parametrize("apart", [True, False])
def test_r002_programs_of_two_processors_are_carried_out_at_once(threads: Rig, apart: bool) -> None:
    """Each of two programs waits 20 ms in the middle of an invocation for the other: with one instruction stream they never meet."""
    here = threads.rtp.timer("here", period="50 ms", priority=40)
    there = threads.cell.processor("rtp1").timer("there", period="50 ms", priority=40) if apart else here
    up, down = (verb_of(threads, label, activate(label, every="50 ms", budget="10 s")) for label in ("up", "down"))
    ups, downs = outputs_of(threads, "up"), outputs_of(threads, "down")
    up.on(here).asynch(**ups)
    down.on(there).asynch(**downs)
    if apart:
        threads.until(lambda: ups["met"].value + downs["met"].value > 0, "each is carried out while the other is")
    else:
        threads.until(lambda: ups["y"].value >= 5 and downs["y"].value <= -5, "both go on")
        assert ups["met"].value + downs["met"].value == 0, "one after the other"


def held_and_looks(rig: Rig) -> tuple[Any, Any, dict[str, Any], dict[str, Any]]:
    """Starts `held`, which runs from a request of the first source to one of the second, and `looks`, which observes it every ms."""
    beside = rig.cell.processor("rtp1")
    work, let_go = rig.rtp.trigger("work", priority=30), beside.trigger("let_go", priority=30)
    held, opens = verb_of(rig, "held", activate("held", budget="30 s")), verb_of(rig, "opens", activate("opens"))
    looks = verb_of(rig, "looks", activate("looks", every="1 ms"))
    values = outputs_of(rig, "held")
    seen = outputs_of(rig, "looks", a=values["a"], b=values["b"])
    held.on(work).asynch(**values)
    opens.on(let_go).asynch(**outputs_of(rig, "opens"))
    looks.on(beside.timer("beside", period="1 ms", priority=50)).asynch(**seen)
    # The start also requires an answer from the first source, which comes only between two firings: a request must not overtake it.
    rig.until(lambda: seen["looked"].number, "it looks")
    return work, let_go, values, seen


def test_r049_nothing_of_an_invocation_is_seen_while_it_goes_on(threads: Rig) -> None:
    work, let_go, values, seen = held_and_looks(threads)
    a, b = values["a"], values["b"]
    for k in range(1, 6):
        work.request()
        threads.until(lambda k=k: seen["inside"].value == k, "it is in the middle of an invocation, all of which it has computed")
        before = seen["looked"].value
        threads.until(lambda before=before: seen["looked"].value >= before + 20, "a block of another processor has looked twenty times")
        assert a.history[:]["value"].tolist() == [*range(1, k)], "nor does the programming system see any of it"
        let_go.request()
        threads.until(lambda k=k: a.value == k, "it has returned, and now it is seen")
        assert b.value == -k
    assert seen["looked"].value >= 100 and (seen["early"].value, seen["torn"].value) == (0, 0)


# The block occupies a core at a real-time priority for seconds: two at once would leave nothing to the tests beside them.
@pytest.mark.alone
def test_r049_a_value_that_cannot_be_read_for_long_names_the_block_that_is_at_work(threads: Rig) -> None:
    work, let_go, values, seen = held_and_looks(threads)
    work.request()
    threads.until(lambda: seen["inside"].value == 1, "it is in the middle of an invocation")
    why = r"source 'rtp0.work' did not answer: block 'held' of 'one_held#1' may be in the middle of an invocation; .* or read its history"
    with pytest.raises(gpac.InvalidState, match=why):
        _ = values["a"].value
    assert values["a"].history[:]["value"].tolist() == []
    let_go.request()
    threads.until(lambda: values["a"].value == 1, "it has returned")


# The block occupies a core at a real-time priority for seconds: two at once would leave nothing to the tests beside them.
@pytest.mark.alone
def test_r103_the_supervisor_answers_while_an_invocation_goes_on_at_its_own_processor(threads: Rig) -> None:
    work, let_go, _, seen = held_and_looks(threads)
    assert threads.cell.names["supervisor"] == "rtp0"
    work.request()
    threads.until(lambda: seen["inside"].value == 1, "the supervisor's processor is at work")
    number, y = threads.cell.svv("number"), threads.cell.svv("y")
    assert number.value == 0
    counting = threads.counting().on(threads.cell.sources["rtp1.beside"])
    assert counting(y, limit=20).last == 20, "a verb is defined, created, started, awaited and deleted"
    instance = counting.named("second").asynch(y)
    assert [(of.name, of.state) for of in threads.cell.instances if of.name == "second"] == [("second", "running")]
    instance.suspend()
    instance.resume()
    instance.halt()
    assert instance.report and instance.report.condition == "halted"
    assert any(entry["about"] == "second" and entry["kind"] == "end" for entry in threads.cell.log())
    assert seen["inside"].value == 1, "all of that while one and the same invocation went on"
    let_go.request()
    threads.until(lambda: seen["inside"].value == 0, "it returns")


def test_r021_a_subroutine_is_sequential_and_what_it_works_with_stands_still(threads: Rig) -> None:
    """The block works for 3 ms of each ms: no invocation begins before the previous one has ended, and no input changes while it runs."""
    (u,) = threads.svvs("u")
    threads.counting().on(threads.cell.processor("rtp1").timer("beside", period="1 ms", priority=80)).asynch(u)
    works = verb_of(threads, "works", activate("works", every="1 ms", budget="10 s"))
    found = outputs_of(threads, "works", u=u)
    works.on(threads.fast).asynch(**found)
    threads.until(lambda: found["n"].value >= 30 and found["newest"].value >= 60, "it runs beside what it reads")
    assert threads.cell.statistics["sources"]["rtp0.fast"]["overruns"] > 0, "it is due again long before it has ended"
    assert (found["others"].value, found["changed"].value) == (0, 0)


def test_r021_the_same_subroutine_runs_twice_at_once_where_the_program_says_so(threads: Rig) -> None:
    """Concurrency is a matter of configuration: the subroutine is unchanged."""
    (u,) = threads.svvs("u")
    works = verb_of(threads, "works", activate("works", every="1 ms", budget="10 s"))
    found = [outputs_of(threads, "works", prefix, u=u) for prefix in ("first", "second")]
    for source, of in zip((threads.fast, threads.cell.processor("rtp1").timer("fast", period="1 ms", priority=80)), found, strict=True):
        works.on(source).asynch(**of)
    threads.until(lambda: any(of["others"].value > 0 for of in found), "two instances work at once, on a processor each")


@pytest.mark.parametrize("processor", ["rtp0", "rtp1"])
def test_r035_an_instance_stays_on_the_instruction_stream_of_its_processor(real: Rig, processor: str) -> None:
    source = real.fast if processor == "rtp0" else real.cell.processor("rtp1").timer("fast", period="1 ms", priority=80)
    where = verb_of(real, "where", activate("where", every="1 ms"))
    found = outputs_of(real, "where")
    beside = outputs_of(real, "where", "beside")
    instance = where.on(source).asynch(**found)
    where.on(real.slow, every={"where": "10 ms"}).asynch(**beside)
    real.until(lambda: found["n"].value >= 50 and beside["n"].value >= 5, "both run")
    thread = found["thread"].value
    assert thread not in (0, beside["thread"].value), "another source, another stream"
    instance.suspend()
    instance.resume()
    before = found["n"].value
    real.until(lambda: found["n"].value >= before + 20, "it goes on")
    assert found["moved"].value == 0 and found["thread"].value == thread
    with pytest.raises(gpac.CallError, match="must be placed on an interrupt source"):
        where.on({"where": [real.fast, real.slow]})
    with pytest.raises(gpac.UnknownName, match=r"where\.n"):
        where.on({"where": real.fast, "where.n": real.slow}).new_instance(**found)


def test_r048_the_frequency_that_is_measured_is_the_one_that_is_asked_for(real: Rig) -> None:
    """Measured with the machine's own clock, read in each invocation, and with invocation numbers: a skipped release has consumed one."""
    for every, period_ns in (("1 ms", 1_000_000), ("4 ms", 4_000_000)):
        verb = verb_of(real, "clocked", activate("clocked", every=every))
        ns = real.cell.svv(f"ns_{period_ns}", "int64_t", history=400)
        with verb.on(real.fast).asynch(ns) as instance:
            real.until(lambda ns=ns: len(ns.history) == 400, "400 invocations")
            instance.halt()
        rows = ns.history[:]
        numbers = rows["number"].astype(np.int64)
        np.testing.assert_allclose(rows["time"], rows["time"][0] + (numbers - numbers[0]) * period_ns * 1e-9, atol=1e-9)
        # Lateness of each invocation except for a constant; a busy machine makes some late, but none early.
        late = rows["value"] - numbers * period_ns
        first, last = late[:200].min(), late[200:].min()
        span = (numbers[200:].mean() - numbers[:200].mean()) * period_ns
        assert abs(last - first) < 0.02 * span, "the mean frequency"
