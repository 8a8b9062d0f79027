# SPDX-License-Identifier: Apache-2.0
"""FMUs as blocks: their values compared with fmpy's, the effect of a start, several instances, and refusals."""

from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave

import opengpac as gpac
from fmi.making import description, lag
from fmi.making import library as library_of
from opengpac import activate, library, on

INPUTS = [1.0, 1.0, -0.5, 2.0, 2.0, 0.0]


def by_fmpy(file: Path, version: int, step: float, k: float) -> np.ndarray:
    """Makes the same steps with fmpy; returns rows of y, n and on."""
    description = fmpy.read_model_description(file)
    folder = fmpy.extract(file)
    kind: Any = FMU2Slave if version == 2 else FMU3Slave
    identifier = description.coSimulation.modelIdentifier
    unit = kind(guid=description.guid, unzipDirectory=folder, modelIdentifier=identifier, instanceName="lag")
    unit.instantiate()
    set_real, get_real = (unit.setReal, unit.getReal) if version == 2 else (unit.setFloat64, unit.getFloat64)
    get_whole = unit.getInteger if version == 2 else unit.getInt32
    set_real([3], [k])
    if version == 2:
        unit.setupExperiment(startTime=0.0)
    unit.enterInitializationMode()
    rows = []
    for i, u in enumerate(INPUTS):
        set_real([1], [u])
        if i == 0:
            unit.exitInitializationMode()
        else:
            unit.doStep(currentCommunicationPoint=(i - 1) * step, communicationStepSize=step)
        rows.append([get_real([2])[0], get_whole([5])[0], float(unit.getBoolean([6])[0])])
    unit.freeInstance()
    return np.array(rows)


@pytest.mark.parametrize("version", [2, 3])
def test_a_block_has_the_values_of_fmpy(tmp_path: Path, version: int) -> None:
    file = lag(tmp_path / "lag.fmu", version, resources=version == 3)
    block = gpac.fmu(file)
    assert [(i.name, i.kind, i.type, i.unit) for i in block.items.values() if i.kind in ("input", "output", "parameter")] == [
        ("u", "input", "double", "V"), ("hold", "input", "bool", ""), ("y", "output", "double", "V"), ("count_n", "output", "int32_t", ""),
        ("on", "output", "bool", ""), ("k", "parameter", "double", ""), ("tau", "parameter", "double", "s"),
        ("mode", "parameter", "int32_t", ""), ("gain", "parameter", "double", ""),
    ]  # fmt: skip
    for k in (3.0, 5.0):
        ran = block.run(every="20 ms", u=INPUTS, hold=[False] * 6, k=k)
        assert np.array_equal(np.column_stack([ran.y, ran.count_n, ran.on]), by_fmpy(file, version, 0.02, k))


def running(block: gpac.FmuBlock) -> gpac.Verb[..., gpac.Report]:
    """Returns a verb that runs the block for 100 ms."""
    return gpac.Verb(
        "running",
        blocks={"wave": library.signal_generator(shape=1), "lag": block, "clock": library.time_limit(limit=0.1)},
        instantiation_parameters={"y": "lag.y"},
        cells={"u": ["wave.y", "lag.u"]},
        command_lists={"start": [activate("wave", every="5 ms"), activate("lag"), activate("clock", every="5 ms")]},
        conditions={"over": on("clock.expired", returns=[])},
    )


def test_each_start_and_each_instance_has_an_fmu_of_its_own(tmp_path: Path) -> None:
    block = gpac.fmu(lag(tmp_path / "lag.fmu", 2), inputs=["u"], outputs=["y"], parameters=[], instances=2)
    with gpac.System("cell", clock="virtual") as cell:
        source = cell.processor("rtp0").timer("slow", period="5 ms")
        ends = []
        for i in range(5):
            y = cell.svv(f"y{i}")
            running(block).on(source)(y)
            ends.append(y.value)
        assert len(set(ends)) == 1 and ends[0] != 0.25
        alive = [running(block).on(source).asynch(cell.svv(f"z{i}")) for i in range(2)]
        # A third one takes the FMU instance that has been idle longest.
        assert running(block).on(source)(cell.svv("third")).condition == "over"
        reports = []
        for instance in alive:
            try:
                reports.append(instance.wait().condition)
            except gpac.Terminated as ended:
                reports.append(str(ended).partition(" at ")[0].rpartition(" ")[2])
        assert reports.count("3") == 1 and reports.count("over") == 1


def test_a_process_gives_the_bits_of_the_virtual_clock_and_a_record_is_run_again(tmp_path: Path) -> None:
    block = gpac.fmu(lag(tmp_path / "lag.fmu", 3), inputs=["u"], outputs=["y"], parameters=["k"])
    verb = gpac.Verb(
        "stepping",
        blocks={"lag": block, "clock": library.time_limit(limit=0.1)},
        instantiation_parameters={"u": "lag.u", "y": "lag.y"},
        modes={"lag.u": "asynchronous"},
        command_lists={"start": [activate("lag", every="5 ms"), activate("clock", every="5 ms")]},
        conditions={"over": on("clock.expired", returns=[])},
    )
    by_time = []
    for place in ("virtual", "process"):
        with gpac.System("cell", clock="virtual" if place == "virtual" else "monotonic") as cell:
            if place == "virtual":
                cell.record(tmp_path / "run.mcap", replay=True)
            y = cell.svv("y", history=100)
            source = cell.processor("rtp0", process=place == "process").timer("slow", period="5 ms", priority=50)
            verb.on(source)(cell.svv("u", unit="V", initial=1.0), y)
            rows = y.history[1:]
            gaps = np.flatnonzero(np.diff(rows["number"]) > 3)
            rows = rows[: gaps[0] + 1] if len(gaps) else rows
            by_time.append({round((row["time"] - rows[0]["time"]) * 1e3): row["value"] for row in rows})
    # A release that a busy machine skipped has no value; its step is made with the next one. The loss of a gap is not made up for.
    common = by_time[0].keys() & by_time[1].keys()
    assert len(common) >= 3 and all(by_time[0][time] == by_time[1][time] for time in common)
    assert gpac.replay(tmp_path / "run.mcap", show=["y"], trust=True).same


def test_a_step_that_fails_is_a_fault_until_the_next_start(tmp_path: Path) -> None:
    block = gpac.fmu(lag(tmp_path / "lag.fmu", 2))
    assert "fault 4" in block.run(u=[1.0] * 3, hold=[False] * 3, mode=99).fault["text"]
    assert "fault 8" in block.run(u=[1.0] * 3, hold=[False] * 3, tau=0.0).fault["text"]
    assert block.run(u=[1.0] * 3, hold=[False] * 3).fault is None


def test_an_fmu_of_one_step_size_is_run_at_that(tmp_path: Path) -> None:
    file = lag(tmp_path / "lag.fmu", 2, xml=description(2, attributes='canHandleVariableCommunicationStepSize="false"'))
    block = gpac.fmu(file, inputs=["u"], outputs=["y"], every="20 ms")
    assert block.run(every="20 ms", u=[1.0] * 3).fault is None
    assert "fault 6" in block.run(every="10 ms", u=[1.0] * 3).fault["text"]
    with pytest.raises(gpac.SchedulingError, match=r"activated every 5 ms, .* 20 ms"):
        gpac.Verb("wrong", blocks={"lag": block}, instantiation_parameters={"u": "lag.u"}, modes={"lag.u": "asynchronous"},
                  command_lists={"start": [activate("lag", every="5 ms")]})  # fmt: skip


@pytest.mark.parametrize("attributes", ['canHandleVariableCommunicationStepSize="true"', 'canHandleVariableCommunicationStepSize="false"'])
def test_time_that_was_lost_is_not_made_up_for(tmp_path: Path, attributes: str) -> None:
    file = lag(tmp_path / "lag.fmu", 2, xml=description(2, attributes=attributes))
    block = gpac.fmu(file, inputs=["u"], outputs=["y"], every="5 ms")
    verb = gpac.Verb(
        "stepping",
        blocks={"lag": block},
        instantiation_parameters={"u": "lag.u", "y": "lag.y"},
        modes={"lag.u": "asynchronous"},
        command_lists={"start": [activate("lag", every="5 ms")]},
    )
    nap = gpac.Verb("nap", blocks={"b": library.flag}, command_lists={"start": [activate("b")]}, instantiation_parameters={"b": "b.y"})
    with gpac.System("cell", clock="virtual") as cell:
        rtp = cell.processor("rtp0")
        hog = rtp.trigger("hog", priority=90, virtual_cost="500 ms")
        nap.on(hog).asynch(cell.svv("napped", bool))
        y = cell.svv("y", history=1000)
        verb.on(rtp.timer("slow", period="5 ms", priority=50)).asynch(cell.svv("u", unit="V", initial=1.0), y)
        cell.advance("20 ms")
        hog.request()
        cell.advance("600 ms")
        rows = y.history[1:]
        assert np.diff(rows["number"]).max() > 90, "releases were skipped"
        even = gpac.fmu(file, inputs=["u"], outputs=["y"], every="5 ms").run(every="5 ms", u=[1.0] * (len(rows) + 1)).y[1:]
        assert np.allclose(rows["value"], even, atol=1e-12), "every invocation goes on by one step of 5 ms"


def refused(folder: Path) -> dict[str, tuple[Path, dict[str, Any], str]]:
    """Returns the refused cases, with words of the message."""
    good = lag(folder / "good.fmu", 2)
    no_zip = folder / "no.fmu"
    no_zip.write_text("no archive")

    def wrong(name: str, version: int = 2, **given: Any) -> Path:
        return lag(folder / f"{name}.fmu", version, **given)

    def said(version: int = 2, **given: Any) -> str:
        return description(version, **given)

    furlong = '<ScalarVariable name="y" valueReference="2" causality="output"><Real unit="furlong"/></ScalarVariable>'
    return {
        "no file": (folder / "none.fmu", {}, "does not exist"),
        "no archive": (no_zip, {}, "not a zip archive"),
        "damaged": (wrong("damaged", xml="<fmi"), {}, "damaged"),
        "version": (wrong("version", xml=said(told="1.0")), {}, "has FMI version 1.0"),
        "kind": (wrong("kind", xml=said().replace("CoSimulation", "ModelExchange")), {}, "supports ModelExchange, but not co-simulation"),
        "tool": (wrong("tool", xml=said(attributes='needsExecutionTool="true"')), {}, "requires the tool that exported it at run time"),
        "platform": (wrong("platform", folder="win64"), {}, "binaries for win64, but this machine is linux64"),
        "no binary": (wrong("binary", folder="-"), {}, "no binary"),
        "step": (
            wrong("step", xml=said(attributes='canHandleVariableCommunicationStepSize="false"')),
            {},
            "canHandleVariableCommunicationStepSize",
        ),
        "unit": (wrong("unit", xml=said(variables=furlong)), {}, "the unknown unit 'furlong'"),
        "token": (wrong("token", xml=said(token="{other}")), {}, "rejects instantiation"),
        "library": (wrong("library", binary=b"\x7fELF nothing"), {}, "cannot be loaded"),
        "functions": (wrong("functions", 3, xml=said(3), binary=library_of(2)), {}, "lacks a function"),
        "an input": (good, {"inputs": ["v"]}, "input 'v' of 'lag' is not a number"),
        "a parameter": (good, {"parameters": ["u"]}, "parameter 'u' of 'lag' is an input"),
        "a name": (good, {"inputs": {"u": "in"}}, "cannot be named 'in'"),
        "two names": (good, {"inputs": {"u": "a", "hold": "a"}}, "would both be named 'a'"),
        "units of": (good, {"units": {"w": "m"}}, "units= of 'lag' names 'w'"),
        "no output": (good, {"outputs": []}, "no output"),
        "instances": (good, {"instances": 0}, "must be an integer from 1 to 1024, not 0"),
        "interpreter": (wrong("python", binary=b"\x7fELF libpython3.11.so.1.0"), {}, "gpac.drivers.fmu(path, step='10 ms')"),
    }


def test_what_cannot_be_used_is_refused_by_name(tmp_path: Path) -> None:
    said = {}
    for what, (file, given, _) in refused(tmp_path).items():
        try:
            said[what] = str(gpac.fmu(file, **given))
        except gpac.Error as refusal:
            said[what] = str(refusal)
    assert {what: words in said[what] for what, (_, _, words) in refused(tmp_path).items()} == dict.fromkeys(said, True), said
