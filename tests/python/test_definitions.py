# SPDX-License-Identifier: Apache-2.0
"""Definitions as Python values: graphs, references, signatures, quantities, reports, notebooks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import opengpac as gpac
from opengpac import activate, on
from opengpac import library as lib
from opengpac.values.encoding import dtype_of, from_bytes, lively, plain
from opengpac.values.quantities import duration_ns
from rig import Rig


def smooth() -> gpac.Graph:
    """Returns two blocks in series."""
    return gpac.Graph(
        "smooth",
        blocks={"gain": lib.block("gain")(k=2.0), "filter": lib.block("lowpass")(alpha=1.0)},
        inputs={"u": "gain.u"},
        outputs={"y": "filter.y"},
        cells={"scaled": ["gain.y", "filter.u"]},
    )


def test_a_graph_is_a_value() -> None:
    old = smooth()
    new = old.insert("limit", lib.block("limit")(high=3.0), between=("gain.y", "filter.u"))
    assert "limit" not in old.blocks and old.cells == {"scaled": ["gain.y", "filter.u"]}
    assert new.cells == {"scaled": ["gain.y", "limit.u"], "limit": ["limit.y", "filter.u"]}
    assert new.remove("limit").cells == {"scaled": ["gain.y", "filter.u"]}
    assert repr(new.replace("limit", lib.block("gain")(k=5.0)).blocks["limit"]) == "library.gain(k=5.0)"


def test_a_block_can_be_inserted_behind_an_input() -> None:
    assert smooth().insert("limit", lib.block("limit"), between=("u", "gain.u")).inputs == {"u": ["limit.u"]}


def test_a_wrong_insertion_names_the_connections() -> None:
    with pytest.raises(gpac.UnknownName, match=r"scaled \(gain\.y, filter\.u\)"):
        smooth().insert("limit", lib.block("limit"), between=("gain.u", "filter.u"))
    with pytest.raises(gpac.DefinitionError, match="already"):
        smooth().insert("gain", lib.block("limit"), between=("gain.y", "filter.u"))


def test_a_graph_with_a_hole_is_refused() -> None:
    with pytest.raises(gpac.Error, match=r"filter\.u|nowhere"):
        gpac.Graph("hole", blocks={"filter": lib.block("lowpass")}, outputs={"y": "filter.nowhere"})


def test_a_graph_stands_where_a_block_may(rig: Rig) -> None:
    y = rig.cell.svv("y")
    verb = gpac.Verb(
        "graphed",
        blocks={"count": rig.block("count.count"), "smooth": smooth()},
        instantiation_parameters={"y": "smooth.y"},
        cells={"c": ["count.y", "smooth.u"]},
        command_lists={"start": [activate("count", every="1 ms"), activate("smooth")]},
    )
    verb.on(rig.fast).asynch(y)
    rig.cell.advance("5 ms")
    assert y.value == 8


def test_a_verb_of_the_library_acts_on_a_device_that_a_downloaded_block_keeps_going(rig: Rig) -> None:
    keeping = gpac.Verb(
        "keeping",
        blocks={"sample": rig.block("copy.sample")},
        instantiation_parameters={"commanded": "sample.u", "sensed": "sample.y"},
        command_lists={"start": [activate("sample", every="1 ms"), gpac.ready()]},
    )

    class Kept(gpac.LogicalDevice, verb=keeping):
        """Device whose verb has a block of its own."""

        commanded: gpac.SVV[float] = gpac.svv()
        sensed: gpac.SVV[float] = gpac.svv()

    swing = gpac.Verb(
        "swing",
        blocks={"wave": lib.block("signal_generator")(shape=0, offset=3.0)},
        objects={"device": Kept},
        instantiation_parameters={"device.commanded": "wave.y"},
        command_lists={"start": [activate("wave", every="1 ms"), gpac.wait("5 ms"), gpac.deactivate("wave")]},
    )
    device = Kept("kept", on=rig.fast).enable()
    assert (swing >> swing).on(rig.fast)(device).condition == "completed"
    rig.cell.advance("1 ms")
    assert device.sensed.value == 3.0


def test_references_stand_where_names_may(rig: Rig) -> None:
    count = rig.block("count.count").labelled("count")
    verb = gpac.Verb(
        "by_reference",
        blocks=[count],
        instantiation_parameters={"y": count.y},
        input_parameters={"limit": gpac.input(count.enough, default=2)},
        command_lists={"start": [activate(count, every="1 ms")]},
        conditions={"enough": on(count.enough, returns=[])},
    )
    assert verb.instantiation_parameters == {"y": ["count.y"]}
    with pytest.raises(gpac.UnknownName, match="did you mean 'enough'"):
        _ = count.enuogh
    (a,) = rig.svvs("a")
    assert verb.on(rig.fast)(a).condition == "enough"


def test_a_decorated_verb_takes_its_call_from_the_function(rig: Rig) -> None:
    class Counted(gpac.Report):
        last: float

    @gpac.verb(
        blocks={"count": rig.block("count.count")},
        instantiation_parameters={"y": "count.y"},
        input_parameters={"limit": "count.enough"},
        output_values={"last": "count.y"},
        command_lists={"start": [activate("count", every="1 ms")]},
        conditions={"enough": on("count.enough", returns=["last"])},
    )
    def counted(y: gpac.SVV[float], limit: float = 4) -> Counted:  # type: ignore[empty-body]
        """Counts up to a limit."""

    (a,) = rig.svvs("a")
    report = counted.on(rig.fast)(a)
    assert type(report) is Counted and report.last == 4
    assert counted.__doc__ == "Counts up to a limit." and counted.__name__ == "counted"
    assert "limit" in repr(counted) and "ends, returns last" in repr(counted)


def test_a_function_that_does_not_fit_is_refused(rig: Rig) -> None:
    with pytest.raises(gpac.DefinitionError, match="did you mean 'limit'"):

        @gpac.verb(
            blocks={"count": rig.block("count.count")},
            input_parameters={"limit": "count.enough"},
            command_lists={"start": [activate("count", every="1 ms")]},
        )
        def counted(limti: float = 4) -> None:
            """Counts."""


def test_a_system_is_rebuilt_if_nothing_runs(memory_rig: Rig) -> None:
    (a,) = memory_rig.svvs("a")
    vi = memory_rig.counting().on(memory_rig.fast).asynch(a)
    with pytest.raises(gpac.InUse, match=vi.name):
        gpac.System("cell", clock="virtual")
    vi.halt()
    vi.wait()
    with gpac.System("cell", clock="virtual") as again:
        assert memory_rig.cell.closed and again.names["svvs"] == []


def test_everything_has_a_repr(rig: Rig) -> None:
    (a,) = rig.svvs("a", unit="m")
    assert "SVV a (double) = 0.0 m" in repr(a)
    assert "rtp0" in repr(rig.cell) and "fast" in repr(rig.rtp) and "0.001 s" in repr(rig.fast)
    assert "supervisor: rtp0\n" in repr(rig.cell)
    assert "a > 1" in repr(a > 1) and not (a > 1)
    assert "output y" in repr(rig.block("count.count"))
    assert "<table>" in rig.counting("shown")._repr_html_()


def test_predicates_combine(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    rig.counting().on(rig.fast).asynch(a)
    rig.cell.advance(until=(a >= 5) & ~(b > 0))
    assert a.value == 5


def test_a_trial_needs_no_system() -> None:
    trial = lib.block("limit").run(low=-1, high=1, limited=0.5, u=np.array([0.0, 2.0]))
    assert trial.y.tolist() == [0, 1] and trial.fault is None and [c[:2] for c in trial.conditions] == [(1, "limited")]
    with pytest.raises(AttributeError, match=r"did you mean|there is"):
        _ = trial.z


def test_a_trial_takes_structs(memory_rig: Rig, tmp_path: Path) -> None:
    source = tmp_path / "heading.c"
    source.write_text(
        '#include <opengpac.h>\nTYPE(pose, "Position and heading.", field(double[3], p), field(double, yaw));\n'
        'FUNCTION_BLOCK(heading, "y = yaw.", in(pose, at, "pose"), out(double, y, "heading")) { self->y = self->at.yaw; return OK; }\n'
    )
    heading = memory_rig.cell.download(source).heading
    assert heading.run(at=([1, 2, 3], 0.5)).y.tolist() == [0.5]
    assert heading.run(at=[([1, 2, 3], 0.5), {"p": [0, 0, 0], "yaw": 0.25}]).y.tolist() == [0.5, 0.25]


def test_an_end_of_a_verb_of_the_package_names_the_line_of_the_call(rig: Rig) -> None:
    drive = rig.rtp.physical_device("drive", gpac.drivers.loopback("x"), exchange=rig.fast)
    joint = gpac.robots.Joint("x", drive=drive["x"], on=rig.fast, kp=50.0, kd=0.0)
    joint.enable()
    with pytest.raises(gpac.robots.MotionTimeout) as caught:
        gpac.robots.move.on(every={"generator": "10 ms", "near": "10 ms"})([joint], goal=[1.0], time_limit="0.1 s")  # type: ignore[arg-type]
    assert caught.value.file == __file__


@given(st.integers(min_value=1, max_value=10**6), st.sampled_from(["ns", "us", "ms", "s"]))
def test_durations_are_exact(number: int, unit: str) -> None:
    assert duration_ns(f"{number} {unit}") == number * {"ns": 1, "us": 1000, "ms": 10**6, "s": 10**9}[unit]


@given(
    st.recursive(st.one_of(st.booleans(), st.integers(-100, 100), st.floats(-1e6, 1e6)), lambda s: st.lists(s, max_size=4), max_leaves=8)
)
def test_plain_values_are_json(value: object) -> None:
    assert plain(value) == value


def test_values_of_structs() -> None:
    tree = {"struct": [["p", {"array": [{"scalar": "double"}, 2]}, 0], ["n", {"scalar": "int32_t"}, 16]], "size": 24}
    dtype = dtype_of(tree)
    record = np.zeros((), dtype=dtype)
    record["p"], record["n"] = [1, 2], 7
    value = from_bytes(record.tobytes(), dtype)
    assert plain(value) == {"p": [1.0, 2.0], "n": 7}
    assert lively([[1.0], [2.0]]).shape == (2, 1)


def test_a_trial_gives_the_value_of_a_condition() -> None:
    assert lib.block("limit").run(low=-1, high=1, u=[0.5, 2.0]).conditions == [(1, "limited", 1.0)]


def test_a_load_that_is_refused_leaves_nothing_behind() -> None:
    with gpac.System("cell", clock="virtual") as cell:
        rtp = cell.processor("rtp0")
        odd, good = rtp.timer("odd", period="3 ms", priority=70), rtp.timer("good", period="1 ms", priority=80)
        with pytest.raises(gpac.Error):
            gpac.robots.load("two_joint", rtp, on=odd)
        assert not cell.names["devices"] and not cell.names["logical_devices"] and not cell.names["svvs"]
        arm = gpac.robots.load("two_joint", rtp, on=good)
        arm.enable()
        with pytest.raises(gpac.InvalidState, match="bound by"):
            cell.physical_devices["two_joint"].delete()


def test_rights_that_are_not_given_are_said_once_in_one_line(caplog: pytest.LogCaptureFixture) -> None:
    with gpac.System("cell") as cell:
        fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
        verb = gpac.Verb("once", blocks={"s": lib.block("signal_generator")}, command_lists={"start": [gpac.execute("s")]})
        verb.on(fast)()
        verb.on(fast)()
        missing = cell.statistics["sources"]["rtp0.fast"]["rights_missing"]
    lines = [record.getMessage() for record in caplog.records if record.name == "opengpac"]
    assert len(lines) == (1 if missing else 0) and all(m in lines[0] for m in missing)


def test_instances_of_a_verb_are_counted_from_one() -> None:
    with gpac.System("cell", clock="virtual") as cell:
        fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
        verb = gpac.Verb("once", blocks={"s": lib.block("signal_generator")}, command_lists={"start": [gpac.execute("s")]})
        assert [verb.on(fast)().instance for _ in range(3)] == ["once#1", "once#2", "once#3"]
