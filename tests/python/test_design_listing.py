# SPDX-License-Identifier: Apache-2.0
"""The listing of the design page, as it is printed there, on devices that follow their effort."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

import opengpac as gpac
from opengpac import activate, execute, on
from opengpac import library as lib
from rig import Rig


class FollowingError(gpac.Terminated):
    """A joint is too far from its set-point."""


class MotionTimeout(gpac.Terminated):
    """A motion took too long."""


class Moved(gpac.Report):
    """Where the joints are."""

    position: Sequence[float]


def test_the_listing_runs(rig: Rig) -> None:
    cell, rtp, fast = rig.cell, rig.rtp, rig.fast
    slow = rtp.timer("twenty", period="20 ms", priority=55)
    ur5e = rtp.physical_device("ur5e", gpac.drivers.loopback("pan", "lift", initial=[0.1, 0.2]), exchange=fast)

    servo = gpac.Verb(
        "joint_servo",
        blocks={"read": lib.read_channel, "pid": lib.pid, "write": lib.write_channel},
        instantiation_parameters={
            "drive.position": ["read.channel"],
            "drive.effort": ["write.channel"],
            "sensed": ["read.y", "pid.measured"],
            "commanded": ["pid.setpoint"],
        },
        cells={"effort": ["pid.effort", "write.u"]},
        input_parameters={"kp": gpac.input("pid.kp", tunable=True), "max_effort": ["pid.limit"]},
        modes={"pid.setpoint": "asynchronous"},
        command_lists={"start": [execute("read"), activate("read", every="1 ms"), activate("pid"), activate("write"), gpac.ready()]},
        conditions={"following_error": on("pid.following_error", raises=FollowingError)},
    )

    class Joint(gpac.LogicalDevice, verb=servo):
        sensed: gpac.SVV[float] = gpac.svv(unit="rad")
        commanded: gpac.SVV[float] = gpac.svv(unit="rad", initial="sensed")
        goal: gpac.SVV[float] = gpac.svv(unit="rad")
        max_speed = gpac.parameter(3.14, unit="rad/s")
        max_effort = gpac.parameter(150.0, unit="N.m")
        kp = gpac.parameter(80.0, tunable=True)

    arm = gpac.Group("arm", *(Joint(name, drive=ur5e[name], on=fast) for name in ur5e.parts))

    @gpac.verb(
        blocks={"planner": lib.trajectory_planner, "generator": lib.setpoint_generator, "near": lib.in_position},
        objects={"arm": gpac.each(Joint)},
        instantiation_parameters={
            "arm.commanded": ["planner.start", "generator.setpoint"],
            "arm.goal": ["planner.target", "near.goal"],
            "arm.sensed": ["near.sensed"],
        },
        cells={"coefficients": ["planner.coefficients", "generator.coefficients"]},
        input_parameters={"goal": ["planner.goal"], "speed": ["planner.speed"], "arm.max_speed": ["planner.speed_max"]},
        output_values={"position": "near.sensed"},
        command_lists={"start": [execute("planner"), activate("generator", every="20 ms"), activate("near", every="20 ms")]},
        conditions={"arrived": on("near.done", returns=["position"]), "time_limit": on(raises=MotionTimeout)},
        transitions={},
    )
    def move(arm: gpac.Group[Joint], /, goal: Sequence[float], speed: float = 0.5) -> Moved:  # type: ignore[empty-body]
        """Move the joints so that all arrive together. goal: rad; speed: rad/s."""

    arm.enable()
    r = move.on(slow)(arm, goal=gpac.deg([0, -90]), speed=0.5, time_limit="10 s")
    assert r.condition == "arrived" and type(r) is Moved
    assert r.position == pytest.approx(gpac.deg([0, -90]), abs=0.01)
    assert r.time > 3

    move.on(slow)(arm, goal=["10 deg", "-80 deg"], speed="30 deg/s")  # type: ignore[arg-type]
    assert arm.values("sensed") == pytest.approx(gpac.deg([10, -80]), abs=0.01)

    vi = move.on(slow).new_instance(arm)
    vi.start([0.0, 0.0], 0.5)
    vi.wait()
    vi.start([0.1, 0.1], 0.4)
    vi.wait()
    vi.delete()
    cell.place({"move.*": slow})
    with pytest.raises(MotionTimeout) as caught:
        move(arm, [2.0, 2.0], speed=0.1, time_limit="1 s")
    assert caught.value.verb == "move" and caught.value.time == pytest.approx(1.0, abs=0.021)
