# SPDX-License-Identifier: Apache-2.0
"""A failure in a block is contained: the Python process survives, and the other verbs continue."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import pytest

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib
from rig import Rig

IN_THE_BLOCK = ["refuses", "not_a_number"]
BY_A_SIGNAL = ["divides", "null_pointer", "endless"]


def failing(rig: Rig, block: str, **changes: Any) -> gpac.Verb[..., Any]:
    """Returns a verb whose block fails at invocation 3."""
    definition: dict[str, Any] = {
        "blocks": {"bad": rig.block(f"faults.{block}")},
        "instantiation_parameters": {"y": "bad.y"},
        "output_values": {"last": "bad.y"},
        "command_lists": {"start": [activate("bad", every="1 ms")]},
    }
    return gpac.Verb(f"failing_{block}", **{**definition, **changes})


@pytest.mark.parametrize("block", IN_THE_BLOCK)
def test_a_fault_of_a_block_ends_its_verb_only(rig: Rig, block: str) -> None:
    good, bad = rig.svvs("good", "bad")
    rig.counting().on(rig.fast).asynch(good)
    with pytest.raises(gpac.Terminated) as caught:
        failing(rig, block).on(rig.fast)(bad, time_limit="1 s")
    assert (caught.value.condition, caught.value.block) == ("fault", "bad")
    before = good.value
    rig.cell.advance("10 ms")
    assert good.value == before + 10, "the other verb runs on in the same source"
    assert bad.value in (2, 3), "the last good sample"


@pytest.mark.parametrize("block", BY_A_SIGNAL)
def test_a_signal_in_a_block_stops_its_source_only(memory_rig: Rig, block: str) -> None:
    rig = memory_rig
    doomed = rig.rtp.timer("doomed", period="1 ms", priority=50)
    good, bad = rig.svvs("good", "bad")
    rig.counting().on(rig.fast).asynch(good)
    with pytest.raises(gpac.Terminated) as caught:
        failing(rig, block).on(doomed)(bad, time_limit="10 s")
    assert (caught.value.condition, caught.value.block) == ("fault", "bad")
    before = good.value
    rig.cell.advance("10 ms")
    assert good.value == before + 10, "the other sources run on"
    assert bad.value == 2
    assert rig.cell.statistics["sources"][doomed.name]["stopped"]


@pytest.mark.parametrize("block", BY_A_SIGNAL)
def test_after_a_signal_the_devices_of_the_source_are_safe(memory_rig: Rig, block: str) -> None:
    rig = memory_rig
    doomed = rig.rtp.timer("doomed", period="1 ms", priority=50)
    drive = rig.rtp.physical_device("drive", gpac.drivers.loopback("x"), exchange=doomed)
    (bad,) = rig.svvs("bad")
    pushing = gpac.Verb(
        "pushing",
        blocks={"write": lib.block("write_channel")},
        instantiation_parameters={"effort": "write.channel"},
        input_parameters={"u": "write.u"},
        modes={"write.u": "asynchronous"},
        command_lists={"start": [activate("write", every="1 ms")]},
    )
    vi = pushing.on(doomed).asynch(drive["x"].effort, u=1.0)
    with pytest.raises(gpac.Terminated):
        failing(rig, block).on(doomed)(bad, time_limit="10 s")
    with pytest.raises(gpac.Terminated) as caught:
        vi.wait()
    assert caught.value.condition == "fault"


def test_what_was_stored_before_a_fault_has_its_own_number(memory_rig: Rig) -> None:
    rig = memory_rig
    doomed = rig.rtp.timer("doomed", period="1 ms", priority=50)
    y, bad = rig.cell.svv("y", history=10), rig.svvs("bad")[0]
    with pytest.raises(gpac.Terminated):
        failing(
            rig,
            "endless",
            blocks={"count": rig.block("count.count"), "bad": rig.block("faults.endless")},
            instantiation_parameters={"y": "count.y", "bad": "bad.y"},
            output_values={},
            command_lists={"start": [activate("count", every="1 ms"), activate("bad", every="1 ms", budget="20 ms")]},
        ).on(doomed)(y, bad, time_limit="10 s")
    for _ in ("stopped", "reset"):
        snapshot = rig.cell.read(y, bad)
        assert [*snapshot.numbers] == [snapshot[0], 2], "each value has the number of its own invocation"
        history = y.history[:]
        assert (history["value"] == history["number"]).all() and history["number"][-1] == snapshot.numbers[0]
        rig.cell.reset()


def test_a_low_pass_recovers_at_the_next_good_sample(rig: Rig) -> None:
    y = rig.cell.svv("y", history=50)
    verb = gpac.Verb(
        "filtering",
        blocks={"bad": rig.block("faults.not_a_number"), "filter": lib.block("lowpass")(alpha=0.5)},
        instantiation_parameters={"y": "filter.y"},
        cells={"c": ["bad.y", "filter.u"]},
        command_lists={"start": [activate("bad", every="1 ms"), activate("filter")]},
        transitions={("start", "fault"): "start"},
    )
    verb.on(rig.fast).asynch(y)
    rig.cell.advance("10 ms")
    values = y.history[:]["value"]
    assert len(values) >= 6 and (values[1:] >= values[:-1]).all() and values[-1] > 4


def test_a_fault_may_have_a_transition(rig: Rig) -> None:
    (y,) = rig.svvs("y")
    report = failing(
        rig,
        "refuses",
        blocks={"bad": rig.block("faults.refuses"), "count": rig.block("count.count")},
        input_parameters={"limit": "count.enough"},
        command_lists={"start": [activate("bad", every="1 ms")], "after": [activate("count", every="1 ms")]},
        initial="start",
        conditions={"enough": gpac.on("count.enough", returns=["last"])},
        transitions={("start", "fault"): "after"},
    ).on(rig.fast)(y, limit=3, time_limit="1 s")
    assert (report.condition, report.command_list, report.last) == ("enough", "after", 2)


@pytest.mark.parametrize("block", ["null_pointer", "endless"])
def test_after_a_crash_a_transition_leads_to_what_runs_on_other_sources(memory_rig: Rig, block: str) -> None:
    rig = memory_rig
    doomed = rig.rtp.timer("doomed", period="1 ms", priority=50)
    y, z = rig.svvs("y", "z")
    verb = failing(
        rig,
        block,
        blocks={"bad": rig.block(f"faults.{block}"), "count": rig.block("count.count")},
        instantiation_parameters={"y": "bad.y", "z": "count.y"},
        input_parameters={"limit": "count.enough"},
        output_values={"last": "count.y"},
        command_lists={"start": [activate("bad", every="1 ms", budget="20 ms")], "after": [activate("count", every="1 ms")]},
        initial="start",
        conditions={"enough": gpac.on("count.enough", returns=["last"])},
        transitions={("start", "fault"): "after"},
    )
    report = verb.on({"bad": doomed, "count": rig.fast})(y, z, limit=3, time_limit="1 s")
    assert (report.condition, report.command_list, report.last, report.others) == ("enough", "after", 3, ())
    rig.cell.reset()
    rig.cell.download(rig.built["faults"], "faults")
    with pytest.raises(
        gpac.Terminated, match=r"command list 'after' cannot follow: it runs on 'rtp0\.doomed', which is lost too"
    ) as caught:
        verb.on({"bad": doomed, "count": doomed})(y, z, limit=3, time_limit="1 s")
    assert (caught.value.condition, caught.value.command_list) == ("fault", "start")


def test_an_emergency_stop_has_no_transition(memory_rig: Rig) -> None:
    lists = {"start": [activate("count", every="1 ms")], "after": [activate("count", every="2 ms")]}
    with pytest.raises(gpac.DefinitionError, match=r"'emergency_stop'.*can never be taken: an emergency stop ends every verb at once"):
        memory_rig.counting("stopping", command_lists=lists, initial="start", transitions={("start", "emergency_stop"): "after"})


@pytest.fixture(scope="session")
def rust_module() -> Path:
    """Returns the Rust module of the examples, built as its author would."""
    root = Path(__file__).parent.parent.parent
    target = root / "target" / "rust-module"
    command = [
        "cargo",
        "build",
        "--release",
        "--quiet",
        "--manifest-path",
        str(root / "examples/rust-module/Cargo.toml"),
        "--target-dir",
        str(target),
    ]
    subprocess.run(command, check=True)
    return target / "release" / "librust_module.so"


def test_a_panic_in_a_rust_block_ends_its_verb_only(rig: Rig, rust_module: Path, capfd: pytest.CaptureFixture[str]) -> None:
    code = rig.cell.download(rust_module)
    (good,) = rig.svvs("good")
    b, y = rig.cell.svv("b", "int64_t", initial=2), rig.cell.svv("y", "int64_t")
    rig.counting().on(rig.fast).asynch(good)
    dividing = gpac.Verb(
        "dividing",
        blocks={"d": code.divide(a=12)},
        instantiation_parameters={"b": "d.b", "y": "d.y"},
        modes={"d.b": "asynchronous"},
        command_lists={"start": [activate("d", every="1 ms")]},
    )
    vi = dividing.on(rig.fast).asynch(b, y)
    rig.cell.advance("3 ms")
    assert y.value == 6
    b.value = 0
    with pytest.raises(gpac.Terminated, match="panicked") as caught:
        vi.wait()
    assert (caught.value.condition, caught.value.block) == ("fault", "d")
    before = good.value
    rig.cell.advance("10 ms")
    assert (good.value, y.value) == (before + 10, 6)
    assert "panicked" not in capfd.readouterr().err, "a caught panic is silent"
