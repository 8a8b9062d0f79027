# SPDX-License-Identifier: Apache-2.0
"""Ranges: every value from a program is checked before anything moves. All declarations of library blocks, device types and motion verbs
are covered: values that are not numbers, infinite, negative where that is impossible, or of another unit are refused with a message."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Callable, Iterator
from decimal import Decimal
from fractions import Fraction
from typing import Any, cast

import numpy as np
import pytest

import opengpac as gpac
from opengpac import _native, activate, motion, wait
from opengpac import library as lib
from opengpac.cell import AnalogOutput
from opengpac.definition.blocks import Block, Item
from opengpac.robots import Joint
from opengpac.robots.gripper import Finger

NUMBER = re.compile(r"(double|float|u?int(8|16|32|64)_t)(\[.*\])?")
NOT_FINITE = [math.nan, math.inf, -math.inf]


def blocks() -> list[Block]:
    """Returns all blocks of the library."""
    found = [getattr(lib, name) for name in dir(lib)]
    return [block for block in found if isinstance(block, Block)]


def ranged_items() -> list[tuple[Block, Item]]:
    """Returns the parameters, presets and defaulted inputs of library blocks that are numbers."""
    is_given = lambda item: item.kind == "parameter" or (item.kind == "input" and item.has_default)  # noqa: E731
    return [(b, item) for b in blocks() for item in b.items.values() if is_given(item) and NUMBER.fullmatch(item.type)]


def ends(text: str) -> tuple[float, float, bool]:
    """Returns minimum and maximum of a range, and whether the minimum itself is excluded."""
    least, most = text[1:-1].split(",")
    return float(least), float(most), text[0] == "("


def used(block: Block, item: Item, value: Any) -> gpac.Graph:
    """Returns a graph that uses the block with this constant."""
    given = [value] if "[" in item.type or item.sized else value
    sizes = {i.name: 1 for i in block.items.values() if i.kind == "size"}
    inputs = {i.name: f"b.{i.name}" for i in block.items.values() if i.kind == "input" and i.name != item.name}
    outputs = {i.name: f"b.{i.name}" for i in block.items.values() if i.kind == "output"}
    constants = {item.name: given, **({} if item.sized else sizes)}
    return gpac.Graph("tried", blocks={"b": block(**constants)}, inputs=inputs, outputs=outputs, doc="A block with a constant.")


def test_every_number_that_a_library_block_is_given_has_a_range() -> None:
    without = [f"{block.name}.{item.name}" for block, item in ranged_items() if not item.range]
    assert not without and len(ranged_items()) > 150


NO_LIMIT = {"library.motion_generator.fastest"}
"""Defaults outside the range that mean no limit: only values from a program are checked."""


def test_defaults_are_within_their_ranges() -> None:
    for block, item in ranged_items():
        if f"{block.name}.{item.name}" in NO_LIMIT:
            continue
        least, most, is_above = ends(item.range)
        scalar = item.type.split("[")[0]
        values = np.frombuffer(item.initial, {"double": "f8", "float": "f4"}.get(scalar, scalar.removesuffix("_t")))
        good = (values >= least) & (values <= most) & ~(is_above & (values == least))
        assert good.all() or np.isnan(values).any(), f"{block.name}.{item.name}: {values} of {item.range}"


@pytest.mark.parametrize("where", ["below", "above"])
def test_constants_of_library_blocks_are_within_their_ranges(where: str) -> None:
    tried = 0
    for block, item in ranged_items():
        least, most, is_above = ends(item.range)
        if "[" in item.type and not item.sized:
            continue  # A constant of an array has as many numbers as that.
        wrong = least if is_above else least - 1 if where == "below" else most + 1
        if not math.isfinite(wrong) or (item.type.startswith("u") and wrong < 0):
            continue
        with pytest.raises(gpac.OutOfRange, match=rf"{item.name}.* cannot be "):
            used(block, item, wrong if item.type.startswith("double") else int(wrong))
        tried += 1
    assert tried > 15


@pytest.mark.parametrize("value", NOT_FINITE)
def test_constants_are_finite(value: float) -> None:
    for block, item in ranged_items():
        with pytest.raises(gpac.ValueRefused, match="must be finite, not"):
            used(block, item, value)


def test_constants_of_another_unit_are_refused() -> None:
    for block, item in ranged_items():
        if item.unit and "[" not in item.type:
            with pytest.raises(gpac.UnitMismatch, match="the dimensions differ"):
                used(block, item, "1 kg.m2.A")


# ---- device types ----


@pytest.fixture
def cell() -> Iterator[gpac.System]:
    with gpac.System("ranges", clock="virtual") as cell:
        yield cell


@pytest.fixture
def joint(cell: gpac.System) -> Joint:
    rtp = cell.processor("rtp0")
    fast = rtp.timer("fast", period="1 ms", priority=80)
    rtp.timer("slow", period="20 ms", priority=60)
    device = rtp.physical_device("d", gpac.drivers.loopback("x"), exchange=fast)
    return Joint("x", drive=device["x"], on=fast, position_min=-2.0, position_max=2.0, kp=50.0, kd=0.0)


@pytest.mark.parametrize("kind", [Joint, Finger, AnalogOutput])
def test_every_number_of_a_device_type_has_a_range_or_a_unit(kind: type[gpac.LogicalDevice]) -> None:
    for name, member in kind.parameter_members().items():
        is_number = isinstance(member.default, int | float) and not isinstance(member.default, bool)
        assert not is_number or member.within is not None or member.unit or name == "at_enable", name


def test_every_parameter_of_a_joint_is_looked_at(joint: Joint) -> None:
    for name, member in Joint.parameter_members().items():
        if isinstance(member.default, bool):
            continue
        before = getattr(joint, name)
        for wrong in NOT_FINITE:
            with pytest.raises(gpac.ValueRefused, match="must be finite, not"):
                setattr(joint, name, wrong)
        with pytest.raises(gpac.UnitMismatch):
            setattr(joint, name, "1 kg.m2.A")
        with pytest.raises(gpac.OutOfRange, match=rf"parameter '{name}' of device 'x' cannot be .*: its range is "):
            setattr(joint, name, -1e300)
        setattr(joint, name, before)
        assert getattr(joint, name) == before


NEGATIVE = ["max_speed", "jog_speed", "max_acceleration", "max_jerk", "max_effort", "max_following_error", "kp", "ki", "kd"]


@pytest.mark.parametrize("name", NEGATIVE)
def test_what_cannot_be_negative_is_not_when_it_is_set_and_when_the_joint_is_made(joint: Joint, name: str) -> None:
    with pytest.raises(gpac.OutOfRange, match=rf"parameter '{name}' of device 'x' cannot be -5"):
        setattr(joint, name, -5)
    wrong: dict[str, Any] = {name: -5.0}
    with pytest.raises(gpac.OutOfRange, match=rf"parameter '{name}' of device 'y' cannot be -5"):
        Joint("y", drive=joint.system.physical_devices["d"]["x"], on=joint.system.sources["rtp0.fast"], **wrong)
    assert "y" not in joint.system.devices


def test_a_range_of_positions_has_its_lower_end_first(joint: Joint) -> None:
    with pytest.raises(gpac.OutOfRange, match=r"'position_min' of device 'x' cannot be 3 rad: its range is .* to 2 rad \(position_max\)"):
        joint.position_min = 3.0
    with pytest.raises(gpac.OutOfRange, match="'position_max' of device 'x' cannot be -3 rad"):
        joint.position_max = -3.0
    with pytest.raises(gpac.OutOfRange, match="'position_min' of device 'y'"):
        Joint("y", drive=joint.system.physical_devices["d"]["x"], on=joint.system.sources["rtp0.fast"], position_min=0.5, position_max=-0.5)


def test_set_points_are_within_the_range_of_the_joint_as_it_is_now(joint: Joint) -> None:
    for member in ("commanded", "goal"):
        with pytest.raises(gpac.OutOfRange, match=rf"SVV 'x.{member}' cannot be 99 rad: its range is -2 to 2 rad; did you mean '99 deg'\?"):
            setattr(joint, member, 99)
    cast(Any, joint).commanded = "99 deg"
    joint.position_max = 1.0
    with pytest.raises(gpac.OutOfRange, match="its range is -2 to 1 rad"):
        joint.commanded.value = 1.5


def test_a_range_that_cannot_be_is_refused_where_it_is_declared(cell: gpac.System) -> None:
    with pytest.raises(
        gpac.UnknownName,
        match="the range of parameter 'speed' of device type 'A' names 'fastest', which is not one of its numeric parameters",
    ):

        class A(gpac.LogicalDevice):
            speed: float = gpac.parameter(1.0, within=(0, "fastest"))

    with pytest.raises(gpac.OutOfRange, match="parameter 'speed' of device 'B' cannot be 5: its range is 0 to 1"):

        class B(gpac.LogicalDevice):
            speed: float = gpac.parameter(5.0, within=(0, 1))

    with pytest.raises(gpac.DefinitionError, match="give the lower end first"):

        class C(gpac.LogicalDevice):
            level: gpac.SVV[float] = gpac.svv(within=(1, 0))

    with pytest.raises(gpac.ValueRefused, match="the lower end first"):
        cell.svv("level", within=(1, 0))
    with pytest.raises(gpac.ValueRefused, match="names a parameter, but it is not an SVV of a device"):
        cell.svv("level", within=(0, "most"))  # type: ignore[arg-type]


def test_an_svv_keeps_to_its_range(cell: gpac.System) -> None:
    level = cell.svv("level", within="(0, inf)", initial=1.0)
    level.value = 1e12
    with pytest.raises(gpac.OutOfRange, match="SVV 'level' cannot be 0: its range is above 0"):
        level.value = 0.0
    far = cell.svv("far", unit="m")
    with pytest.raises(gpac.OutOfRange, match=r"SVV 'far' cannot be 1e300 m: its range is .*; give a value"):
        far.value = "1e300 m"


# ---- verbs ----


@pytest.fixture(scope="module")
def arm() -> Iterator[gpac.robots.Arm]:
    arm = gpac.robots.load("ur5e", clock="virtual").enable()
    yield arm
    arm.system.close()


Calls = dict[str, Callable[[gpac.robots.Arm, Any], Any]]


def _home(arm: gpac.robots.Arm) -> list[float]:
    return arm.values("home")


def _pose(arm: gpac.robots.Arm) -> gpac.Pose:
    return gpac.Pose((0, 0, 0.01)) @ arm.pose()


INPUTS: Calls = {
    "robots.move speed": lambda arm, x: gpac.robots.move(arm, _home(arm), speed=x),
    "robots.move tolerance": lambda arm, x: gpac.robots.move(arm, _home(arm), tolerance=x),
    "move_absolute goal": lambda arm, x: motion.move_absolute(arm, x),
    "move_absolute speed": lambda arm, x: motion.move_absolute(arm, _home(arm), speed=x),
    "move_absolute acceleration": lambda arm, x: motion.move_absolute(arm, _home(arm), acceleration=x),
    "move_relative": lambda arm, x: motion.move_relative(arm, x),
    "move_velocity": lambda arm, x: motion.move_velocity(arm, x, time_limit="10 ms"),
    "stop": lambda arm, x: motion.stop(arm, deceleration=x),
    "move_linear speed": lambda arm, x: motion.move_linear(arm, _pose(arm), speed=x),
    "move_linear angular_speed": lambda arm, x: motion.move_linear(arm, _pose(arm), angular_speed=x),
    "move_linear acceleration": lambda arm, x: motion.move_linear(arm, _pose(arm), acceleration=x),
    "move_linear tolerance": lambda arm, x: motion.move_linear(arm, _pose(arm), tolerance=x),
    "move_circular speed": lambda arm, x: motion.move_circular(arm, _pose(arm), _pose(arm), speed=x),
    "move_linear x": lambda arm, x: motion.move_linear(arm, [x, *list(_pose(arm))[1:]]),
    "follow_linear speed": lambda arm, x: motion.follow_linear(arm, [_pose(arm)], speed=[x]),
    "follow_linear angular_speed": lambda arm, x: motion.follow_linear(arm, [_pose(arm)], angular_speed=x),
    "follow speed": lambda arm, x: motion.follow(arm, [_home(arm)], speed=[x]),
    "follow blend": lambda arm, x: motion.follow(arm, [_home(arm)], blend=[x]),
    "follow tolerance": lambda arm, x: motion.follow(arm, [_home(arm)], tolerance=x),
    "gear acceleration": lambda arm, x: motion.gear(arm[0], arm[1].commanded, acceleration=x, time_limit="10 ms"),
    "carry": lambda arm, x: motion.carry(arm, x, time_limit="10 ms"),
    "payload": lambda arm, x: gpac.robots.Payload(x),
    "override": lambda arm, x: setattr(arm[0], "override", x),
    "cell override": lambda arm, x: setattr(arm.system, "override", x),
    "time_limit": lambda arm, x: motion.move_absolute(arm, _home(arm), time_limit=x),
    "age_max": lambda arm, x: cast(Any, motion.move_absolute)(arm, _home(arm), age_max=x),
    "pose x": lambda arm, x: arm.inverse(gpac.Pose((x, 0, 0))),
}

SIGNED = ("move_absolute goal", "move_relative", "move_velocity", "move_linear x", "pose x")
"""Values that may be negative."""


@pytest.mark.parametrize("value", [*NOT_FINITE, 1e300, "nan", "inf s", "1 kg.m2.A", None, 1j], ids=str)
@pytest.mark.parametrize("of", INPUTS)
def test_what_is_no_number_is_refused_before_anything_moves(arm: gpac.robots.Arm, of: str, value: Any) -> None:
    if value is None and of in ("time_limit", "age_max"):
        return  # None is no limit.
    if value == "1 kg.m2.A" and of.endswith("override"):
        return  # Nothing is known of the unit of a number that is declared without one.
    before = arm.values("commanded")
    with pytest.raises(
        (gpac.ValueRefused, gpac.UnitMismatch, gpac.OutOfRange, gpac.Unreachable, gpac.CallError, gpac.InstallationErrors)
    ) as caught:
        INPUTS[of](arm, value)
    assert arm.values("commanded") == before
    assert "Some(" not in str(caught.value) and "panicked" not in str(caught.value)


@pytest.mark.parametrize("of", [name for name in INPUTS if name not in SIGNED])
def test_what_cannot_be_negative_is_refused(arm: gpac.robots.Arm, of: str) -> None:
    before = arm.values("commanded")
    with pytest.raises((gpac.OutOfRange, gpac.InstallationErrors), match=r"range is|must be above 0"):
        INPUTS[of](arm, -1.0)
    assert arm.values("commanded") == before


ASKED_BACK: dict[str, tuple[Callable[[gpac.robots.Arm], Any], str]] = {
    "mm/s": (lambda arm: motion.move_linear(arm, _pose(arm), speed=200), r"did you mean '200 mm/s'\?"),
    "deg/s": (lambda arm: gpac.robots.move(arm, _home(arm), speed=200), r"did you mean '200 deg/s'\?"),
    "deg": (lambda arm: motion.move_absolute(arm.elbow, 90), r"did you mean '90 deg'\?"),
    "yaw": (lambda arm: gpac.Pose(rpy=(0, 0, 90)), r"the yaw of a pose cannot be 90 rad: .*; did you mean '90 deg'\?"),
    "mm": (lambda arm: motion.move_linear(arm, gpac.Pose((4000, 0, 0))), r"did you mean '4000 mm'\?"),
    "kg": (lambda arm: gpac.robots.Payload(250_000), r"did you mean '250000 g'\?"),
}


@pytest.mark.parametrize("unit", ASKED_BACK)
def test_a_number_far_beyond_its_range_asks_back(arm: gpac.robots.Arm, unit: str) -> None:
    call, message = ASKED_BACK[unit]
    with pytest.raises(gpac.OutOfRange, match=message):
        call(arm)


def test_a_unit_with_a_choice_is_that_of_the_joints(arm: gpac.robots.Arm) -> None:
    move: Any = gpac.robots.move
    with pytest.raises(gpac.UnitMismatch, match="'speed': cannot convert '20 mm/s' to rad/s"):
        move(arm, _home(arm), speed="20 mm/s")
    with pytest.raises(gpac.UnitMismatch, match="'tolerance': cannot convert '1 mm' to rad"):
        move(arm, _home(arm), tolerance="1 mm")
    assert move(arm, _home(arm), speed="60 deg/s", tolerance="0.2 deg").condition == "arrived"


def test_a_quaternion_has_length_1(arm: gpac.robots.Arm) -> None:
    for call in (motion.move_linear, lambda arm, pose: motion.follow_linear(arm, [pose])):
        with pytest.raises((gpac.OutOfRange, gpac.ValueRefused), match="length"):
            call(arm, [0.4, 0, 0.5, 0, 0, 0, 0])


@pytest.mark.parametrize("limit", ["-1 s", "0 s", 0, -1])
def test_a_time_limit_is_above_0(arm: gpac.robots.Arm, limit: Any) -> None:
    with pytest.raises(gpac.OutOfRange, match=r"'time_limit' must be above 0 s, not .* s"):
        motion.move_absolute(arm, _home(arm), time_limit=limit)
    instance = motion.move_absolute.new_instance(arm)
    with pytest.raises(gpac.OutOfRange, match="'time_limit' must be above 0 s"):
        instance.start(_home(arm), time_limit=limit)
    instance.delete()


NUMBERS = [np.float32(0.5), np.float16(0.5), np.longdouble(0.5), np.int8(0), np.array(0.5), Fraction(1, 2), Decimal("0.5"), "0.5 rad", 0.5]


@pytest.mark.parametrize("number", NUMBERS, ids=lambda n: type(n).__name__)
def test_numbers_of_every_kind_are_accepted(arm: gpac.robots.Arm, number: Any) -> None:
    assert motion.move_absolute(arm.wrist_3, number).condition == "arrived"
    arm.wrist_3.commanded = number
    assert arm.wrist_3.commanded.value == pytest.approx(0.0 if isinstance(number, np.integer) else 0.5)


def test_a_range_declared_behind_a_unit_in_c_is_kept(cell: gpac.System, tmp_path: Any) -> None:
    source = tmp_path / "ranged.c"
    source.write_text(
        "#include <opengpac.h>\n"
        'FUNCTION_BLOCK(ranged, "y = k.", param(double, k, 0.5, "factor", "rad/s [0, 1]"), out(double, y, "k", "rad/s")) '
        "{ self->y = self->k; return OK; }\n"
    )
    code = cell.download(str(source))
    item = code.ranged.items["k"]
    assert (item.unit, item.range) == ("rad/s", "[0, 1]")
    fast = cell.processor("rtp0").timer("fast", period="1 ms")
    verb = gpac.Verb(
        "run",
        blocks={"b": code.ranged},
        instantiation_parameters={"y": "b.y"},
        input_parameters={"k": "b.k"},
        command_lists={"start": [activate("b", every="1 ms")]},
    )
    y = cell.svv("y", unit="rad/s")
    with pytest.raises(gpac.OutOfRange, match="'k' cannot be 57 rad/s: its range is 0 to 1 rad/s; did you mean '57 deg/s'"):
        verb.on(fast).asynch(y, k=57.0)
    (tmp_path / "wrong.c").write_text(source.read_text().replace("[0, 1]", "[1, 0]").replace("ranged", "wrong"))
    with pytest.raises(gpac.Error, match=r"the range after the unit in 'rad/s \[1, 0\]' cannot be read; write, for example"):
        gpac.Verb(
            "run",
            blocks={"b": cell.download(str(tmp_path / "wrong.c")).wrong},
            instantiation_parameters={"y": "b.y"},
            command_lists={"start": [activate("b", every="1 ms")]},
        )


def test_a_payload_is_checked_where_it_is_written() -> None:
    with pytest.raises(gpac.OutOfRange, match="the mass of a payload cannot be -3 kg: its range is 0 to 100000 kg") as caught:
        gpac.robots.Payload(-3)
    assert str(caught.value).rpartition(" at ")[2].startswith(__file__)
    with pytest.raises(gpac.OutOfRange, match="the centre of mass of a payload cannot be 250"):
        gpac.robots.Payload(1.0, (0, 0, 250))
    assert dataclasses.asdict(gpac.robots.Payload(2, (0, 0, 0.1))) == {"mass": 2, "centre": (0, 0, 0.1), "inertia": (0,) * 6}


NEGATIVE_TIMES: dict[str, Callable[[gpac.System], Any]] = {
    "the interval of 'a' cannot be -1 ms": lambda cell: activate("a", every="-1 ms"),
    "the interval of 'a' cannot be -2 s": lambda cell: activate("a", every=gpac.interval(-2)),
    "the budget of 'a' cannot be -1 us": lambda cell: activate("a", every="1 ms", budget="-1 us"),
    "the time of a wait cannot be -0.5 s": lambda cell: wait(-0.5),
    "the virtual cost of source 'slow' cannot be -1 s": lambda cell: cell.processor("rtp9").timer("slow", period="1 s", virtual_cost=-1),
    "lost_after cannot be -1 s": lambda cell: cell.processor("apart", process=True, lost_after="-1 s"),
    "the duration to advance cannot be -1 s": lambda cell: cell.advance(-1),
    "the duration to advance cannot be -3 ms": lambda cell: cell.advance("-3 ms"),
    "within cannot be -1 s": lambda cell: cell.advance(until=lambda: False, within=-1),
    "the period of timer 'back' cannot be -1 ms": lambda cell: cell.processor("rtp9").timer("back", period="-1 ms"),
    "patience cannot be -1 s": lambda cell: cell.processor("apart", process=True, patience="-1 s"),
}


@pytest.mark.parametrize("said", NEGATIVE_TIMES)
def test_a_time_that_cannot_be_negative_is_refused_in_words(cell: gpac.System, said: str) -> None:
    with pytest.raises(gpac.OutOfRange, match=re.escape(f"{said}: its range is at least 0 s; give a time that is not negative")):
        NEGATIVE_TIMES[said](cell)


def test_a_system_does_not_advance_backwards_through_any_door(cell: gpac.System) -> None:
    with pytest.raises(_native.Refused, match=r"OutOfRange.*the duration to advance cannot be -1 s"):
        cell._alive().advance(-1_000_000_000)


WHOLE_NUMBERS: dict[str, Callable[[gpac.System, int], Any]] = {
    "the core of processor 'p' must be an integer from 0 to 65,535, not {}": lambda cell, n: cell.processor("p", core=n),
    "the priority of source 't' must be an integer from 1 to 98, not {}": lambda cell, n: cell.processor("q").timer(
        "t", period=1, priority=n
    ),
    "the history of SVV 'x' must be an integer from 0 to 4,294,967,295, not {}": lambda cell, n: cell.svv("x", history=n),
    "the seed of system 'z' must be an integer from 0 to ": lambda _, n: gpac.System("z", clock="virtual", seed=n),
    "the first sequence number of the log must be an integer from ": lambda cell, n: cell.log(n),
    "the number of invocations of a trial must be an integer from ": lambda _, n: lib.block("gain").run(steps=n, u=1.0),
}
"""Calls with an integer, and the beginning of the refusal of one out of range."""


@pytest.mark.parametrize("said", WHOLE_NUMBERS)
@pytest.mark.parametrize("number", [-1, 2**70])
def test_a_whole_number_out_of_range_is_refused_as_such(cell: gpac.System, said: str, number: int) -> None:
    with pytest.raises(gpac.OutOfRange, match=re.escape(said.format(number))):
        WHOLE_NUMBERS[said](cell, number)
    with pytest.raises(gpac.CallError):
        WHOLE_NUMBERS[said](cell, "many")  # type: ignore[arg-type]


@pytest.mark.parametrize("duration", [1e30, -1e30, "1e30 s", float("inf")])
def test_a_time_that_nobody_can_count_is_out_of_range(cell: gpac.System, duration: Any) -> None:
    with pytest.raises(gpac.OutOfRange, match=r"the duration to advance .* is out of range; give a time of less than 292 years"):
        cell.advance(duration)
    with pytest.raises(gpac.ValueRefused, match="the duration to advance must be a time, not nan") as refused:
        cell.advance(float("nan"))
    assert not isinstance(refused.value, gpac.OutOfRange)


@pytest.mark.parametrize("text", ["", "x", "1 ms", "[0 1]", "0, 1", "[pose"])
def test_a_text_that_is_no_range_is_refused_in_words(cell: gpac.System, text: str) -> None:
    with pytest.raises(gpac.CallError, match=re.escape(f"the range of SVV 'x' must have two ends, not '{text}'; pass finite numbers")):
        cell.svv("x", within=text)
