# SPDX-License-Identifier: Apache-2.0
# ruff: noqa: E501, I001
"""The program that fixed the design of the Python interface before it existed: every call is as it was first written.

Added are the classes that the program leaves to its reader, the virtual clock, and gains that hold an arm against its weight: with
the default `pid`, P alone, the joints sag and the motion ends with `time_limit`.
"""

from collections.abc import Sequence

import numpy as np

import opengpac as gpac
from opengpac import activate, execute, on, library as lib

class FollowingError(gpac.Terminated):
    pass


class MotionTimeout(gpac.Terminated):
    pass


class Moved(gpac.Report):
    position: np.ndarray


# configuration phase: hardware
cell = gpac.System("cell", clock="virtual")                            # embedded; clock="virtual" in tests; gpac.connect(url) for a remote one
rtp  = cell.processor("rtp0", core=1)                 # supervisor: the first one, unless supervisor=True elsewhere
fast = rtp.timer("fast", period="1 ms", priority=80)  # interrupt sources; also rtp.trigger(...), rtp.software(...)
slow = rtp.timer("slow", period="20 ms", priority=60)
ur5e = rtp.physical_device("ur5e", gpac.drivers.mujoco("ur5e.xml"), exchange=fast)   # parts (joints) with typed, unit-carrying channels

# software: a verb that supports a device (a servo)
code  = cell.download("my_blocks.c")                  # C source, shared object, compiled Rust module
servo = gpac.Verb("joint_servo",
    blocks = {"read": lib.read_channel, "pid": lib.pid(ki=100.0, kd=10.0), "write": lib.write_channel},
    instantiation_parameters = {                                                     # chi: SVVs and device channels
        "drive.position": ["read.channel"], "drive.effort": ["write.channel"],
        "sensed": ["read.y", "pid.measured"], "commanded": ["pid.setpoint"]},
    cells = {"effort": ["pid.effort", "write.u"]},                                   # private SVVs of each instance, part of chi
    input_parameters = {"kp": gpac.input("pid.kp", tunable=True), "max_effort": ["pid.limit"]},                 # psi
    modes = {"pid.setpoint": "asynchronous"},                                        # a use may relax a port's declared mode
    command_lists = {"start": [execute("read"), activate("read", every="1 ms"), activate("pid"), activate("write"), gpac.ready()]},
    conditions = {"following_error": on("pid.following_error", raises=FollowingError)})

class Joint(gpac.LogicalDevice, verb=servo):                                         # members meet the verb's parameters by name
    sensed: gpac.SVV[float] = gpac.svv(unit="rad")
    commanded: gpac.SVV[float] = gpac.svv(unit="rad", initial="sensed")              # copied after the leading executes, before the loop closes
    goal: gpac.SVV[float] = gpac.svv(unit="rad")
    max_speed = gpac.parameter(3.14, unit="rad/s")
    max_effort = gpac.parameter(150.0, unit="N.m")
    kp = gpac.parameter(80.0, tunable=True)

arm = gpac.Group("arm", *(Joint(name, drive=ur5e[name], on=fast) for name in ur5e.parts))

# software: a verb that acts on devices
@gpac.verb(
    blocks  = {"planner": lib.trajectory_planner, "generator": lib.setpoint_generator, "near": lib.in_position},
    objects = {"arm": gpac.each(Joint)},                                             # logical devices; their members join chi and psi
    instantiation_parameters = {"arm.commanded": ["planner.start", "generator.setpoint"],
                                "arm.goal": ["planner.target", "near.goal"], "arm.sensed": ["near.sensed"]},
    cells   = {"coefficients": ["planner.coefficients", "generator.coefficients"]},
    input_parameters = {"goal": ["planner.goal"], "speed": ["planner.speed"], "arm.max_speed": ["planner.speed_max"]},
    output_values = {"position": "near.sensed"},                                     # omega
    command_lists = {"start": [execute("planner"), activate("generator", every="20 ms"), activate("near", every="20 ms")]},
    conditions = {"arrived": on("near.done", returns=["position"]), "time_limit": on(raises=MotionTimeout)},    # t_V, nu, exceptions
    transitions = {})                                                                # tau: {("list", "condition"): "list"}
def move(arm: gpac.Group[Joint], /, goal: Sequence[float], speed: float = 0.5) -> Moved:
    """Move the joints so that all arrive together. goal: rad; speed: rad/s."""

# execution phase
arm.enable()
r = move.on(slow)(arm, goal=gpac.deg([0, -90, 90, 0, 0, 0]), speed=0.5, time_limit="10 s")     # r.condition, r.position, r.time
