# SPDX-License-Identifier: Apache-2.0
"""Calls on a remote system behave as on an embedded one: values of every type, errors, code, waits."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import opengpac as gpac
import swing
from daemons import Daemon
from opengpac import activate, on
from opengpac import library as lib

GAIN = """#include <opengpac.h>
#include "factor.h"
FUNCTION_BLOCK(gain, "Gain: y = FACTOR u.", in(double, u, "input"), out(double, y, "output")) {{ self->y = FACTOR * self->u; {end} }}
"""


@pytest.mark.parametrize(
    ("type", "value"),
    [
        ("double", 0.1), ("float", 0.5), ("bool", True), ("int8_t", -5), ("uint64_t", 2**62 + 1), ("int64_t", -(2**62) - 1),
        ("double[3]", np.array([1.0, 2.5, -3.0])), ("int16_t[2][2]", np.array([[1, 2], [3, 4]])),
    ],
)  # fmt: skip
def test_values_of_every_type_come_as_they_went(far: gpac.System, type: str, value: object) -> None:
    svv = far.svv("x", type)
    svv.value = value
    assert np.array_equal(svv.value, value)
    with gpac.System("near", clock="virtual") as near:
        here = near.svv("x", type)
        here.value = value
        assert (svv.dtype, repr(svv.value)) == (here.dtype, repr(here.value))


def test_a_struct_of_a_code_module(far: gpac.System, tmp_path: Path) -> None:
    file = tmp_path / "place.c"
    file.write_text(
        '#include <opengpac.h>\nTYPE(place, "A place.", field(double, x), field(int32_t[2], n));\n'
        'FUNCTION_BLOCK(turn, "Turns.", in(place, p, "place"), out(place, q, "turned")) { self->q = self->p; return OK; }\n'
    )
    code = far.download(file)
    svv = far.svv("p", code.types.place)
    svv.value = {"x": 1.5, "n": [3, 4]}
    assert svv.value["x"] == 1.5 and list(svv.value["n"]) == [3, 4]


def test_what_was_compiled_here_is_not_fused_there_and_it_says_so(far: gpac.System, tmp_path: Path) -> None:
    file = tmp_path / "one.c"
    file.write_text('#include <opengpac.h>\nFUNCTION_BLOCK(one, "y = 1.", out(double, y, "1")) { self->y = 1; return OK; }\n')
    ones = gpac.Verb("ones", blocks={"one": far.download(file).one}, command_lists={"run": [activate("one", every="1 ms")]})
    ones.on(far.processor("rtp1").timer("beat", period="1 ms", priority=70)).asynch()
    told = far.fuse()
    assert told["single"] == [{"block": "ones#1.one", "why": "it was not built here from a source in C"}]
    assert far.fused == told


def test_a_snapshot_and_a_history(far: gpac.System) -> None:
    y, z = far.svv("y", history=50), far.svv("z", "double[2]", history=5)
    z.value = [1.0, 2.0]
    wave = gpac.Verb(
        "wave", blocks={"wave": lib.signal_generator(shape=3, frequency=10.0)}, instantiation_parameters={"y": "wave.y"},
        command_lists={"start": [activate("wave", every="1 ms")]},
    )  # fmt: skip
    with wave.on(far.sources["rtp0.fast"]).asynch(y):
        far.advance("20 ms")
        values = far.read(y, z)
        assert values.time == far.now and values.numbers[0] == y.number and values[0] == y.value
        rows = y.history[:]
        assert len(rows) == 20 and np.allclose(np.diff(rows["time"]), 1e-3) and rows["value"][-1] == y.value
        far.advance(until=y > 0.9)
        assert y.value > 0.9


REFUSED: list[Callable[[gpac.System], object]] = [
    lambda cell: cell.svv("x", "duble"),
    lambda cell: cell.svv("x", "double[0]"),
    lambda cell: [cell.svv("twice", "double"), cell.svv("twice", "float")],
    lambda cell: setattr(cell.svv("small", within=(0.0, 1.0)), "value", 2.0),
    lambda cell: cell.processor("rtp1").timer("t", period="1 us"),
    lambda cell: cell.processor("rtp0", core=0),
    lambda cell: cell.processor("rtp1", core=4096),
    lambda cell: cell.place({"move": gpac.Source(cell, gpac.Processor(cell, "rtp9"), "fast", "timer", 1_000_000, 5)}),
    lambda cell: cell.resume(gpac.cell.DigitalOutput.__new__(gpac.cell.DigitalOutput)),
    lambda cell: gpac.Verb("none", blocks={"w": lib.signal_generator}, command_lists={"start": [activate("v")]}),
    lambda cell: gpac.Verb("bare", blocks={"w": lib.gain}, command_lists={"start": [activate("w", every="1 ms")]}).on(cell)(),
    lambda cell: cell.alarms.clear("E7"),
    lambda cell: cell.instance("nobody"),
    lambda cell: cell.device("nothing"),
    lambda cell: cell.advance("-1 s"),
]


@pytest.mark.parametrize("call", REFUSED, ids=range(len(REFUSED)))
def test_what_is_refused_is_refused_in_the_same_words(far: gpac.System, call: Callable[[gpac.System], object]) -> None:
    with gpac.System("cell", clock="virtual") as near:
        near.processor("rtp0").timer("fast", period="1 ms", priority=80)
        with pytest.raises(Exception) as here:
            call(near)
        with pytest.raises(Exception) as there:
            call(far)
    assert type(there.value) is type(here.value)
    for field in ("message", "remedy", "ends", "place"):
        assert getattr(there.value, field, None) == getattr(here.value, field, None)
    assert str(there.value) == str(here.value)


def test_code_is_compiled_here_and_loaded_there(far: gpac.System, tmp_path: Path) -> None:
    (tmp_path / "factor.h").write_text("#define FACTOR 3.0\n")
    (tmp_path / "gains.c").write_text(GAIN.format(end="return OK;"))
    code = far.download(tmp_path / "gains.c")
    u, y = far.svv("u", initial=2.0), far.svv("y")
    verb = gpac.Verb(
        "scale", blocks={"g": code.gain, "clock": lib.time_limit(limit=0.01)}, instantiation_parameters={"u": "g.u", "y": "g.y"},
        command_lists={"start": [activate("g", every="1 ms"), activate("clock", every="1 ms")]},
        conditions={"over": on("clock.expired", returns=[])},
        modes={"g.u": "asynchronous"},
    )  # fmt: skip
    verb.on(far.sources["rtp0.fast"])(u, y)
    assert y.value == 6.0
    assert list(code.gain.run(u=[1.0, 2.0]).y) == [3.0, 6.0], "a block is tried here, with no system at all"


def test_a_mistake_in_code_is_shown_at_its_line(far: gpac.System, tmp_path: Path) -> None:
    (tmp_path / "factor.h").write_text("#define FACTOR 3.0\n")
    file = tmp_path / "gains.c"
    file.write_text(GAIN.format(end="retrun OK;"))
    with pytest.raises(gpac.ModuleError, match="retrun") as caught:
        far.download(file)
    assert (caught.value.file, caught.value.line) == (str(file), 3)
    damaged = tmp_path / "damaged.so"
    damaged.write_bytes(b"\x7fELF" + bytes(100))
    with pytest.raises(gpac.ModuleError):
        far.download(damaged)
    with pytest.raises(gpac.ModuleError, match="does not exist"):
        far.download(tmp_path / "nothing.so")


def test_a_wait_has_an_end_and_may_be_gone_on_with(far: gpac.System) -> None:
    joint = swing.build(far).enable()
    instance = swing.swing().on(far.sources["rtp0.slow"]).asynch(joint, seconds=1.0)
    with pytest.raises(TimeoutError, match=r"did not end within 0.25 s; its state is 'running'"):
        instance.wait("250 ms")
    assert 0.25 <= far.now < 0.5
    instance.suspend()
    assert instance.state == "suspended"
    instance.resume()
    assert instance.wait().condition == "over"


def test_tunable_values_emergency_stop_and_alarms(far: gpac.System) -> None:
    joint = swing.build(far).enable()
    joint.kp = 40.0
    assert joint.kp == 40.0
    instance = swing.swing().on(far.sources["rtp0.slow"]).asynch(joint, seconds=5.0)
    far.advance("100 ms")
    far.emergency_stop("a test")
    with pytest.raises(gpac.Terminated) as ended:
        instance.wait()
    assert ended.value.condition == "emergency_stop"
    assert [alarm.code for alarm in far.alarms] == ["emergency_stop"]
    with pytest.raises(gpac.EmergencyStopped):
        joint.enable()
    far.reset()
    assert far.alarms.acknowledge() == 1
    assert far.mode == "automatic" and far.log()[-1]["kind"]


def test_each_alarm_is_acknowledged_alone(far: gpac.System) -> None:
    for code in ("E1", "E2"):
        far.alarms.define(code, f"alarm {code}", severity="low")
        far.alarms.trip(code)
    assert far.alarms.acknowledge(far.alarms["E1"]) == 1 and far.alarms.acknowledge(far.alarms["E1"].number) == 0
    assert [(alarm.code, alarm.severity, alarm.state) for alarm in far.alarms] == [("E1", "low", "acknowledged"), ("E2", "low", "active")]
    far.alarms.clear("E1")
    far.alarms.clear("E2")
    assert [(alarm.code, alarm.state) for alarm in far.alarms] == [("E2", "returned")]
    assert [alarm.state for alarm in far.alarms.history] == ["over"]


async def _both(first: gpac.VerbInstance[gpac.Report], second: gpac.VerbInstance[gpac.Report]) -> list[gpac.Report]:
    return await asyncio.gather(first, second)


def test_an_event_loop_waits_in_virtual_time(far: gpac.System) -> None:
    joint = swing.build(far).enable()
    svv = far.svv("y")
    wave = gpac.Verb(
        "wave", blocks={"wave": lib.signal_generator, "clock": lib.time_limit(limit=0.3)}, instantiation_parameters={"y": "wave.y"},
        command_lists={"start": [activate("wave", every="1 ms"), activate("clock", every="1 ms")]},
        conditions={"over": on("clock.expired", returns=[])},
    )  # fmt: skip
    first = swing.swing().on(far.sources["rtp0.slow"]).asynch(joint, seconds=0.5)
    ended = asyncio.run(_both(first, wave.on(far.sources["rtp0.fast"]).asynch(svv)))
    assert [report.condition for report in ended] == ["over", "over"]


def test_an_event_loop_waits_in_real_time(real_daemon: Daemon) -> None:
    with gpac.connect(real_daemon.url) as cell:
        joint = swing.build(cell).enable()
        verb = swing.swing().on(cell.sources["rtp0.slow"])

        async def cancelled() -> gpac.VerbInstance[gpac.Report]:
            instance = verb.new_instance(joint).start(seconds=1000.0)
            waiting = asyncio.ensure_future(instance)
            await asyncio.sleep(0)
            waiting.cancel()
            with pytest.raises(asyncio.CancelledError):
                await waiting
            return instance

        async def awaited() -> gpac.Report:
            return await verb.asynch(joint, seconds=0.1)

        assert asyncio.run(awaited()).condition == "over"
        halted = asyncio.run(cancelled())
        assert halted.done and halted.report is not None and halted.report.condition == "halted"
        assert asyncio.run(awaited()).condition == "over"


def test_an_event_loop_learns_that_the_system_is_gone(real_daemon: Daemon) -> None:
    cell = gpac.connect(real_daemon.url)
    joint = swing.build(cell).enable()
    instance = swing.swing().on(cell.sources["rtp0.slow"]).asynch(joint, seconds=1000.0)

    async def main() -> None:
        waiting = asyncio.ensure_future(instance)
        await asyncio.sleep(0)
        await asyncio.to_thread(real_daemon.kill)
        await waiting

    with pytest.raises(gpac.ConnectionLost):
        asyncio.run(main())
    cell.close()
