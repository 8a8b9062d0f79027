# SPDX-License-Identifier: Apache-2.0
"""Requirements 111 to 117: state vector variables and logical devices."""

from __future__ import annotations

import pytest

import opengpac as gpac
from opengpac import activate, execute
from opengpac import library as lib
from rig import Rig


@pytest.fixture
def arm(rig: Rig) -> gpac.Group[gpac.robots.Joint]:
    """Returns two joints that follow their effort exactly; how late a busy machine lets them follow is not measured here."""
    gains = {"kp": 50.0, "kd": 0.0, "max_following_error": 10.0}
    drive = rig.rtp.physical_device("drive", gpac.drivers.loopback("x", "y", initial=[0.5, -0.5]), exchange=rig.fast)
    return gpac.Group("arm", *(gpac.robots.Joint(n, drive=drive[n], on=rig.fast, **gains) for n in drive.parts))


def test_r111_an_svv_has_a_value_a_history_and_a_type(rig: Rig) -> None:
    a = rig.cell.svv("a", unit="m", initial=2.5, history=5)
    assert (a.value, a.type, a.unit) == (2.5, "double", "m")
    rig.counting("m_counting").on(rig.fast).asynch(a)
    rig.cell.advance("20 ms")
    last = a.history[:]
    assert last["value"].tolist() == [15, 16, 17, 18, 19]
    assert last["number"].tolist() == sorted(last["number"].tolist())
    assert a.history[-1]["time"] == pytest.approx(0.020)


def test_r112_svvs_need_no_shared_memory(rig: Rig) -> None:
    other = rig.cell.processor("rtp1").timer("fast", period="1 ms", priority=80)
    a, b = rig.svvs("a", "b")
    sampling = gpac.Verb(
        "sampling",
        blocks={"s": rig.block("copy.sample")},
        instantiation_parameters={"u": "s.u", "y": "s.y"},
        command_lists={"start": [activate("s", every="1 ms")]},
    )
    rig.counting().on(rig.fast).asynch(a)
    sampling.on(other).asynch(a, b)
    rig.cell.advance("100 ms")
    assert b.value >= 90


def drums(rig: Rig) -> type[gpac.LogicalDevice]:
    """Returns a device type with a verb, two SVVs and a parameter."""
    turning = gpac.Verb(
        "turning",
        blocks={"count": rig.block("count.count"), "gain": lib.block("gain")},
        instantiation_parameters={"turns": ["count.y", "gain.u"], "angle": "gain.y"},
        input_parameters={"ratio": gpac.input("gain.k", tunable=True)},
        command_lists={"start": [activate("count", every="1 ms"), activate("gain"), gpac.ready()]},
    )

    class Drum(gpac.LogicalDevice, verb=turning):
        """Drum that its verb turns."""

        turns: gpac.SVV[float] = gpac.svv()
        angle: gpac.SVV[float] = gpac.svv()
        pose: gpac.SVV[float] = gpac.svv("double[3]")
        ratio = gpac.parameter(2.0, tunable=True)

    return Drum


def entered(rig: Rig) -> tuple[set[str], set[str], set[str]]:
    """Returns the existing instances, SVVs and logical devices."""
    names = rig.cell.names
    return {*names["instances"]}, {*names["svvs"]}, {*names["logical_devices"]}


def test_r113_a_device_type_is_a_verb_svvs_and_parameters(rig: Rig) -> None:
    """A device brings its own verb instance, SVVs and parameters, which are deleted with it."""
    drum_type = drums(rig)
    one, two = (drum_type(name, on=rig.fast) for name in ("one", "two"))
    assert entered(rig) == (
        {"one.turning", "two.turning"},
        {f"{drum}.{svv}" for drum in ("one", "two") for svv in ("turns", "angle", "pose")},
        {"one", "two"},
    )
    assert [(entry.state, entry.device) for entry in rig.cell.instances] == [("created", "one"), ("created", "two")]
    one.ratio = 5.0
    assert (one.ratio, two.ratio, two.pose.value.tolist()) == (5.0, 2.0, [0, 0, 0])
    for drum, ratio in ((one, 5.0), (two, 2.0)):
        drum.enable()
        rig.until(lambda drum=drum, ratio=ratio: drum.angle.value >= ratio * 10, "its verb has its own parameter")
        drum.disable()
        assert drum.angle.value == ratio * drum.turns.value
    one.delete()
    assert entered(rig) == ({"two.turning"}, {"two.turns", "two.angle", "two.pose"}, {"two"})
    with pytest.raises(gpac.CallError, match="did you mean 'angle'"):
        two.angel = 3.0


def test_r113_they_are_created_together_or_not_at_all(rig: Rig) -> None:
    drum_type = drums(rig)
    taken = rig.cell.svv("drum.pose", "float")
    before = entered(rig)
    with pytest.raises(gpac.InUse, match=r"drum\.pose"):
        drum_type("drum", on=rig.fast)
    assert entered(rig) == before
    taken.delete()
    assert drum_type("drum", on=rig.fast).state == "disabled"


def test_r113_a_device_needs_no_verb(rig: Rig) -> None:
    class Tank(gpac.LogicalDevice):
        """Tank without a verb."""

        level: gpac.SVV[float] = gpac.svv(unit="m", initial=0.5)
        capacity = gpac.parameter(2.0, unit="m")

    tank = Tank("tank", system=rig.cell)
    assert (tank.level.value, tank.level.name, tank.capacity) == (0.5, "tank.level", 2.0)
    assert not rig.cell.instances


def test_r114_a_joint_type_can_be_written(arm: gpac.Group[gpac.robots.Joint]) -> None:
    joint = arm[0]
    assert {"sensed", "commanded", "goal"} <= joint.svv_members().keys()
    assert {"max_speed", "max_effort"} <= joint.parameter_members().keys()


def test_r115_a_device_contributes_svvs_and_parameters(rig: Rig, arm: gpac.Group[gpac.robots.Joint]) -> None:
    arm.enable()
    holding = gpac.Verb(
        "holding",
        blocks={"s": rig.block("copy.sample"), "gain": lib.block("gain")},
        objects={"joint": gpac.robots.Joint},
        instantiation_parameters={"joint.sensed": "s.u", "y": "gain.y"},
        cells={"c": ["s.y", "gain.u"]},
        input_parameters={"joint.max_speed": "gain.k"},
        modes={"gain.u": "asynchronous"},
        command_lists={"start": [execute("s"), execute("gain")]},
    )
    (y,) = rig.svvs("y")
    arm[0].max_speed = 4.0
    holding.on(rig.fast)(arm[0], y)
    assert y.value == pytest.approx(2.0, abs=1e-6)


def test_r116_a_verb_applies_to_one_or_more_devices(rig: Rig, arm: gpac.Group[gpac.robots.Joint]) -> None:
    arm.enable()
    for devices, goal in ((arm, [0.4, -0.4]), (arm[:1], [0.5])):
        report = gpac.robots.move.on(rig.fast, every={"generator": "10 ms", "near": "10 ms"})(devices, goal, speed=1.0)
        assert report.condition == "arrived" and len(report.position) == len(goal)


def test_r117_enabling_a_device_starts_its_verb_instance(rig: Rig) -> None:
    drum = drums(rig)("drum", on=rig.fast)
    (beside,) = rig.svvs("beside")
    rig.counting().on(rig.fast).asynch(beside)

    def verb_instance() -> str:
        return next(entry.state for entry in rig.cell.instances if entry.device == "drum")

    rig.until(lambda: beside.value >= 10, "its source fires")
    assert (drum.state, verb_instance(), drum.turns.value, drum.turns.number) == ("disabled", "created", 0, 0)
    for _ in range(2):
        drum.enable()
        assert (drum.state, verb_instance()) == ("standstill", "running")
        rig.until(lambda: drum.turns.value >= 10, "its verb runs")
        drum.disable()
        assert (drum.state, verb_instance()) == ("disabled", "ended")
        stands, before = drum.turns.value, beside.value
        rig.until(lambda before=before: beside.value >= before + 10, "its source fires on")
        assert drum.turns.value == stands


def test_r117_a_device_must_be_enabled(rig: Rig, arm: gpac.Group[gpac.robots.Joint]) -> None:
    """This is checked at creation and at each start of a verb that uses the device; until then nothing of the verb runs and nothing is
    sent."""
    move = gpac.robots.move.on(rig.fast)
    with pytest.raises(gpac.NotEnabled, match="x"):
        move(arm, [0.0, 0.0])
    assert not [entry for entry in rig.cell.instances if entry.device is None], "nothing was created"
    arm.enable()
    assert all(joint.state == "standstill" for joint in arm)
    moving = move.new_instance(arm)
    moving.start({"x": 0.45}, speed=1.0)
    assert moving.wait().condition == "arrived"
    arm[1].disable()
    commanded = arm.values("commanded")
    with pytest.raises(gpac.NotEnabled, match="y"):
        moving.start([0.0, 0.0])
    assert moving.state == "ended" and arm.values("commanded") == commanded
    arm.enable()
    moving.start({"x": 0.5}, speed=1.0)
    assert moving.wait().condition == "arrived"
    arm.disable()
    assert all(joint.state == "disabled" for joint in arm)


def test_r117_disabling_ends_the_verbs_that_use_it(rig: Rig, arm: gpac.Group[gpac.robots.Joint]) -> None:
    with arm.enabled():
        vi = gpac.robots.move.on(rig.fast).asynch(arm, [2.0, 2.0], speed=0.1)
        rig.cell.advance("50 ms")
        arm[0].disable()
        with pytest.raises(gpac.Terminated) as caught:
            vi.wait()
        assert caught.value.condition == "device_disabled"


def test_r117_enabling_starts_from_the_present(rig: Rig, arm: gpac.Group[gpac.robots.Joint]) -> None:
    arm.enable()
    assert arm.values("commanded") == pytest.approx([0.5, -0.5])
    rig.cell.advance("100 ms")
    assert arm.values("sensed") == pytest.approx([0.5, -0.5])


def test_r117_a_device_whose_verb_ends_is_lost_to_its_users(rig: Rig) -> None:
    # A busy machine takes long to enable it: in real time the failure is set long after that.
    fail_at = "100 ms" if rig.cell.virtual else "5 s"
    drive = rig.rtp.physical_device("failing", gpac.drivers.loopback("z", fail_at=fail_at), exchange=rig.fast)
    joint = gpac.robots.Joint("z", drive=drive["z"], on=rig.fast, kp=50.0, kd=0.0).enable()
    with pytest.raises(gpac.Terminated) as caught:
        gpac.robots.move.on(rig.fast)(gpac.Group("one", joint), [3.0], speed=0.1)
    assert caught.value.condition == "device_lost"


def test_r117_tunable_parameters_act_at_once(rig: Rig) -> None:
    drum = drums(rig)("drum", on=rig.fast).enable()
    for ratio in (3.0, 7.0):
        drum.ratio = ratio
        rig.cell.advance("2 ms")
        assert drum.angle.value == ratio * drum.turns.value > 0


def test_r117_a_device_whose_verb_does_not_say_when_is_ready_when_it_runs(rig: Rig) -> None:
    moving_on = rig.counting(
        "moving_on",
        command_lists={"first": [activate("count", every="1 ms")], "second": [activate("count", every="1 ms")]},
        initial="first",
        input_parameters={"limit": gpac.input("count.enough", default=1)},
        conditions={"enough": gpac.on("count.enough")},
        transitions={("first", "enough"): "second", ("second", "enough"): "second"},
    )

    class Counter(gpac.LogicalDevice, verb=moving_on):
        y: gpac.SVV[float] = gpac.svv()

    counter = Counter("counter", on=rig.fast)
    counter.enable()
    assert counter.state == "standstill"
    rig.cell.advance("5 ms")
    assert counter.state == "standstill" and counter.y.value > 1
    counter.disable()
    assert counter.state == "disabled"
