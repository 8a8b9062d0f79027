# SPDX-License-Identifier: Apache-2.0
"""Requirements 74 to 97: verbs and their mappings."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import opengpac as gpac
from opengpac import activate, execute, install, on, wait
from opengpac import library as lib
from rig import Rig

LONG = 20_000
"""Length of a history whose first values are checked: a busy machine makes the programming system late."""


def two_lists(rig: Rig, name: str = "two_lists", **changes: Any) -> gpac.Verb:
    """Returns a verb that counts in list `first` until `first.enough`, then in list `second`."""
    definition: dict[str, Any] = {
        "blocks": {"first": rig.block("count.count"), "second": rig.block("count.count")},
        "instantiation_parameters": {"a": "first.y", "b": "second.y"},
        "input_parameters": {"limit": "first.enough", "end": "second.enough"},
        "output_values": {"a_last": "first.y", "b_last": "second.y"},
        "command_lists": {"one": [activate("first", every="1 ms")], "two": [activate("second", every="1 ms")]},
        "initial": "one",
        "conditions": {"enough": on("first.enough"), "end": on("second.enough", returns=["a_last", "b_last"])},
        "transitions": {("one", "enough"): "two"},
    }
    return gpac.Verb(name, **{**definition, **changes})


def test_r074_a_verb_has_all_its_components(rig: Rig) -> None:
    json = two_lists(rig).json()
    assert {"blocks", "input_parameters", "output_values", "command_lists", "conditions", "transitions", "cells"} <= json.keys()


def test_r075_instantiation_parameters_are_parameters(rig: Rig) -> None:
    """Instantiation parameters are passed once, at creation; the others at each start; all of them in a call."""
    verb = two_lists(rig)
    assert [*verb.signature.parameters] == ["a", "b", "limit", "end"]
    assert [*verb.arguments_signature.parameters] == ["a", "b"]
    a, b = rig.svvs("a", "b")
    placed = verb.on(rig.fast)
    for wrong in ({}, {"a": a}, {"a": a, "b": b, "limit": 3}):
        with pytest.raises(gpac.CallError, match=r"missing a required argument|unexpected keyword argument 'limit'"):
            placed.new_instance(**wrong)
    with placed.new_instance(b=b, a=a) as instance:
        with pytest.raises(gpac.CallError, match="'a'"):
            instance.start(a=b, limit=1, end=1)
        for limit in (2, 5):
            instance.start(limit=limit, end=1)
            assert instance.wait().a_last == limit
    assert placed(a, b, 3, 1).a_last == 3


def test_r075_a_parameter_is_of_one_kind(rig: Rig) -> None:
    with pytest.raises(gpac.DefinitionError, match="'a' is both an input parameter and an instantiation parameter"):
        two_lists(rig, "both", input_parameters={"a": "first.enough", "end": "second.enough"})
    with pytest.raises(gpac.UnknownName, match=r"'first' .* has no 'yy'"):
        two_lists(rig, "nothing", instantiation_parameters={"a": "first.yy", "b": "second.y"})


def test_r076_chi_maps_parameters_to_data_nodes_and_devices(rig: Rig) -> None:
    drive = rig.rtp.physical_device("drive", gpac.drivers.loopback("x", initial=[1.5]), exchange=rig.fast)
    (y,) = rig.svvs("y")
    reading = gpac.Verb(
        "reading",
        blocks={"read": lib.block("read_channel"), "s": rig.block("copy.copy")},
        instantiation_parameters={"drive.position": "read.channel", "y": "s.y"},
        cells={"c": ["read.y", "s.u"]},
        command_lists={"start": [activate("read", every="1 ms"), activate("s")]},
    )
    reading.on(rig.fast).asynch(drive["x"], y)
    rig.cell.advance("3 ms")
    assert y.value == 1.5


def test_r077_an_uncovered_data_node_is_refused(rig: Rig) -> None:
    with pytest.raises(gpac.CoverError, match=r"copy\.u"):
        gpac.Verb(
            "uncovered",
            blocks={"copy": rig.block("copy.copy")},
            command_lists={"start": [activate("copy")]},
        ).on(rig.fast).new_instance()


def test_r078_an_argument_is_an_svv_or_a_device(rig: Rig) -> None:
    with pytest.raises(gpac.CallError, match="pass an SVV"):
        rig.counting().on(rig.fast)(3.0)


def test_r079_one_parameter_for_two_ports_connects_them(rig: Rig) -> None:
    u, y = rig.svvs("u", "y")
    verb = gpac.Verb(
        "connected",
        blocks={"count": rig.block("count.count"), "copy": rig.block("copy.copy")},
        instantiation_parameters={"u": ["count.y", "copy.u"], "y": "copy.y"},
        command_lists={"start": [activate("count", every="1 ms"), activate("copy")]},
    )
    verb.on(rig.fast).asynch(u, y)
    rig.cell.advance("5 ms")
    assert u.value == y.value == 4


def test_r080_an_svv_of_another_type_is_refused(rig: Rig) -> None:
    integer = rig.cell.svv("integer", "int32_t")
    with pytest.raises(gpac.TypeMismatch, match="int32_t"):
        rig.counting().on(rig.fast).new_instance(integer)


def test_r081_psi_never_reaches_a_device(rig: Rig) -> None:
    with pytest.raises(gpac.Error, match="channel"):
        gpac.Verb(
            "wrong",
            blocks={"read": lib.block("read_channel")},
            input_parameters={"value": "read.channel"},
            command_lists={"start": [activate("read", every="1 ms")]},
        )


def test_r082_inputs_are_stored_before_the_first_invocation(rig: Rig) -> None:
    y = rig.cell.svv("y", history=10)
    verb = gpac.Verb(
        "given",
        blocks={"s": rig.block("copy.sample")},
        instantiation_parameters={"y": "s.y"},
        input_parameters={"u": "s.u"},
        command_lists={"start": [activate("s", every="1 ms")]},
    )
    verb.on(rig.fast).asynch(y, u=7.5)
    rig.cell.advance("1 ms")
    assert y.history[:]["value"].tolist() == [7.5]


def test_r083_psi_sets_the_value_of_a_condition(rig: Rig) -> None:
    (a,) = rig.svvs("a")
    for limit in (2, 6):
        assert rig.counting().on(rig.fast)(a, limit=limit).value == limit


def test_r084_psi_presets_an_output(rig: Rig) -> None:
    (a,) = rig.svvs("a")
    verb = rig.counting("preset", input_parameters={"first": "count.y"}, conditions={}, output_values={})
    vi = verb.on(rig.fast).new_instance(a)
    vi.start(first=41.0)
    assert a.value == 41.0
    rig.cell.advance("2 ms")
    assert a.value == 1


def test_r085_omega_gives_one_value_for_each_output(rig: Rig) -> None:
    with pytest.raises(gpac.DefinitionError, match="exactly one"):
        rig.counting("wrong", output_values={"last": ["count.y", "count.enough"]})


def test_r086_outputs_are_those_at_the_end(rig: Rig) -> None:
    (a,) = rig.svvs("a")
    report = rig.counting().on(rig.fast)(a, limit=9)
    assert report.last == 9
    rig.cell.advance("5 ms")
    assert report.last == 9 and a.value == 9


def test_r087_exactly_one_list_is_initial(rig: Rig) -> None:
    with pytest.raises(gpac.DefinitionError, match="initial"):
        two_lists(rig, "none", initial=None)
    with pytest.raises(gpac.UnknownName, match="three"):
        two_lists(rig, "wrong", initial="three")


def test_r088_a_transition_aborts_one_list_and_starts_another(rig: Rig) -> None:
    a, b = rig.svvs("a", "b", history=50)
    report = two_lists(rig).on(rig.fast)(a, b, limit=4, end=3)
    assert (report.condition, report.command_list) == ("end", "two")
    assert (report.a_last, report.b_last) == (4, 3)
    assert a.history[:]["value"].tolist() == [*range(5)] and b.history[:]["value"].tolist() == [*range(4)]


@pytest.mark.parametrize("elsewhere", [False, True])
def test_r088_what_the_next_list_writes_is_seen_wherever_it_is(rig: Rig, elsewhere: bool) -> None:
    """A guarded move: an SVV advances until it touches, and then returns, on another source. Without the condition it continues."""
    back = rig.cell.processor("rtp1").timer("back", period="1 ms", priority=70) if elsewhere else rig.fast
    z, seen = rig.svvs("z", "seen", history=LONG)
    verb = gpac.Verb(
        "guarded",
        blocks={"go": rig.block("count.count"), "retreat": rig.block("pair.pair")},
        instantiation_parameters={"z": ["go.y", "retreat.b"]},
        input_parameters={"limit": gpac.input("go.enough", default=0)},
        cells={"unused": ["retreat.a"]},
        command_lists={"going": [activate("go", every="1 ms")], "retreating": [activate("retreat", every="1 ms")]},
        initial="going",
        conditions={"touched": on("go.enough")},
        transitions={("going", "touched"): "retreating"},
    )
    rig.sampling().on(rig.slow, every={"s": "10 ms"}).asynch(z, seen)
    instance = verb.on({"go": rig.fast, "retreat": back}).asynch(z, limit=5)
    rig.until(lambda: z.value <= -20 and seen.value <= -20, "it goes back, and who reads the SVV sees it")
    instance.halt()
    values = z.history[:]["value"].tolist()
    # The difference is not always -1: the value is the invocation number, and a release that a busy machine skips consumes a number.
    turn = next(k for k, value in enumerate(values) if value < 0)
    assert values[:turn][:6] == [0, 1, 2, 3, 4, 5] and max(values[turn:]) < 0, "the first list has written nothing since"
    assert (np.diff(z.history[:]["time"]) > -1e-9).all() and (np.diff(z.history[:]["number"]) > 0).all()
    instance.wait()
    instance = verb.on({"go": rig.fast, "retreat": back}).named("on").asynch(z)
    rig.until(lambda: z.value >= 50, "nothing touches: it goes on")
    instance.halt()


def test_r089_the_aborted_blocks_stop_before_the_next_list_runs(rig: Rig) -> None:
    a, b = rig.cell.svv("a", history=50), rig.cell.svv("b", history=50)
    two_lists(rig).on(rig.fast)(a, b, limit=4, end=3)
    assert a.history[:]["time"].max() < b.history[:]["time"].min()


def test_r089_across_sources(rig: Rig) -> None:
    a, b = rig.cell.svv("a", history=50), rig.cell.svv("b", history=50)
    other = rig.cell.processor("rtp1").timer("fast", period="1 ms", priority=80)
    report = two_lists(rig).on({"first": rig.fast, "second": other})(a, b, limit=4, end=3)
    assert report.condition == "end"
    assert a.history[:]["time"].max() <= b.history[:]["time"].min()


def test_r090_a_condition_leads_to_other_lists_from_other_lists(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    verb = gpac.Verb(
        "stages",
        blocks={"count": rig.block("count.count"), "m": rig.block("memory.memory")},
        instantiation_parameters={"a": "count.y", "b": "m.forgets"},
        input_parameters={"limit": "count.enough"},
        command_lists={
            "one": [activate("count", every="1 ms")],
            "two": [activate("count", every="1 ms"), activate("m", every="1 ms")],
            "three": [execute("m")],
        },
        initial="one",
        conditions={"enough": on("count.enough")},
        transitions={("one", "enough"): "two", ("two", "enough"): "three"},
    )
    report = verb.on(rig.fast)(a, b, limit=3)
    assert (report.condition, report.command_list) == ("completed", "three")


def test_r091_a_list_may_lead_to_itself(rig: Rig) -> None:
    """The list is aborted and restarted repeatedly; without the transition it is executed once."""
    (y,) = rig.svvs("y", history=LONG)
    lists = {"again": [install("count"), activate("count", every="1 ms")]}
    leads_on: dict[str, Any] = {"conditions": {"enough": on("count.enough")}, "transitions": {("again", "enough"): "again"}}
    restarting = rig.counting("restarting", command_lists=lists, **leads_on).on(rig.fast)
    instance = restarting.asynch(y, limit=3)
    rig.until(lambda: len(y.history) >= 40, "ten rounds")
    instance.halt()
    assert y.history[:]["value"].tolist()[:40] == 10 * [0, 1, 2, 3]
    instance.wait()
    once = rig.counting("once", command_lists=lists).on(rig.fast)(y, limit=3)
    assert (once.condition, y.value) == ("enough", 3.0)


def test_r091_lists_may_lead_to_each_other_in_a_cycle(rig: Rig) -> None:
    a, b = rig.svvs("a", "b", history=LONG)
    verb = two_lists(
        rig,
        "cycle",
        command_lists={
            "one": [install("first"), activate("first", every="1 ms")],
            "two": [install("second"), activate("second", every="1 ms")],
        },
        conditions={"enough": on("first.enough"), "again": on("second.enough")},
        output_values={},
        transitions={("one", "enough"): "two", ("two", "again"): "one"},
    )
    instance = verb.on(rig.fast).asynch(a, b, limit=2, end=1)
    rig.until(lambda: len(b.history) >= 20, "ten rounds")
    instance.halt()
    assert instance.wait().condition == "halted"
    rows = sorted([(row["time"], "a", row["value"]) for row in a.history[:]] + [(row["time"], "b", row["value"]) for row in b.history[:]])
    assert [(who, value) for _, who, value in rows][:50] == 10 * [("a", 0), ("a", 1), ("a", 2), ("b", 0), ("b", 1)]


def test_r092_without_a_transition_the_verb_ends(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    with pytest.raises(gpac.Terminated) as caught:
        two_lists(rig, "no_tau", transitions={("one", "halted"): "two"}).on(rig.fast)(a, b, limit=4, end=9)
    assert (caught.value.condition, caught.value.command_list) == ("enough", "one")


def test_r093_nu_selects_the_outputs(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    report = two_lists(rig, "some", conditions={"enough": on("first.enough"), "end": on("second.enough", returns=["b_last"])}).on(rig.fast)(
        a, b, limit=1, end=1
    )
    assert dict(report.outputs) == {"b_last": 1}


def test_r094_outputs_outside_nu_are_absent(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    report = two_lists(rig, "none", conditions={"enough": on("first.enough"), "end": on("second.enough", returns=[])}).on(rig.fast)(
        a, b, limit=1, end=1
    )
    with pytest.raises(AttributeError, match="returned no output 'a_last'"):
        _ = report.a_last


def test_r095_term_is_what_has_no_transition_from_some_list(rig: Rig) -> None:
    """`enough` continues from `one` and ends the verb in `two`, where ν states its values; in term_V as printed neither would exist."""
    a, b = rig.svvs("a", "b")
    from_both = two_lists(
        rig,
        command_lists={"one": [activate("first", every="1 ms")], "two": [wait("3 ms"), activate("second", every="1 ms")]},
        conditions={"enough": on(["first.enough", "second.enough"], returns=["b_last"])},
    )
    assert from_both.table() == [("one", "enough", "→ two"), ("two", "enough", "ends, returns b_last")]
    report = from_both.on(rig.fast)(a, b, limit=2, end=4)
    assert (report.condition, report.command_list, dict(report.outputs)) == ("enough", "two", {"b_last": 4.0})


def test_r095_a_condition_that_leads_on_from_every_list_is_not_in_it(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    everywhere = two_lists(
        rig,
        "everywhere",
        conditions={"enough": on(["first.enough", "second.enough"])},
        output_values={},
        transitions={("one", "enough"): "two", ("two", "enough"): "one"},
    )
    assert all(what.startswith("→") for _, _, what in everywhere.table())
    instance = everywhere.on(rig.fast).asynch(a, b, limit=2, end=2)
    rig.until(lambda: b.value >= 5, "it goes round")
    assert instance.state == "running"
    instance.halt()


def test_r095_nothing_is_returned_by_what_is_not_in_it(rig: Rig) -> None:
    """ν is a function on term_V: an entry for a condition that ends nothing is refused."""
    conditions = {"enough": on(["first.enough", "second.enough"], returns=["a_last"])}
    both = {("one", "enough"): "two", ("two", "enough"): "one"}
    with pytest.raises(gpac.Error, match="enough"):
        two_lists(rig, "never", conditions=conditions, transitions=both)
    assert two_lists(rig, "sometimes", conditions=conditions).on(rig.fast)(*rig.svvs("a", "b"), limit=2, end=2).a_last == 2


def test_r096_transitions_name_lists_and_conditions_that_exist(rig: Rig) -> None:
    with pytest.raises(gpac.UnknownName, match="three"):
        two_lists(rig, "wrong", transitions={("one", "enough"): "three"})
    with pytest.raises(gpac.UnknownName, match="enogh"):
        two_lists(rig, "wrong", transitions={("one", "enogh"): "two"})


def test_r097_transitions_need_no_programming_system(rig: Rig) -> None:
    a, b = rig.cell.svv("a", history=50), rig.cell.svv("b", history=50)
    two_lists(rig).on(rig.fast).asynch(a, b, limit=4, end=1000)
    rig.cell.advance("50 ms")  # one call: nothing is asked of Python in between
    gap = b.history[:]["time"].min() - a.history[:]["time"].max()
    assert abs(gap - 1e-3) < 1e-9, "the next firing"
