# SPDX-License-Identifier: Apache-2.0
"""Coordinated motion of the six joints of a UR5e: the example of the paper, on a simulated robot in real time.

The arm starts at its home position. It moves in the three ways in which a verb can be invoked, meets an unexpected force, recovers,
and ends with a report and a plot. With `--driver ur` the driver of its controller, which is emulated, commands it. The exit code is 0
only if every move ended as expected.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

import opengpac as gpac
import programs
from opengpac import activate, deactivate, execute, on, wait
from opengpac import library as lib
from opengpac.cell import wait_for_input
from opengpac.robots import Joint, Moved, move
from programs import Account, Trace


class UnexpectedForce(gpac.Terminated):
    """Raised if the tool met a force above the limit; `value` is its magnitude in N."""


@gpac.verb(
    blocks={
        "planner": lib.trajectory_planner,
        "generator": lib.setpoint_generator,
        "near": lib.in_position,
        "sensor": lib.read_vector,
        "guard": lib.force_guard,
    },
    objects={"arm": gpac.each(Joint)},
    instantiation_parameters={
        "arm.commanded": ["planner.start", "generator.setpoint"],
        "arm.goal": ["planner.target", "near.goal"],
        "arm.sensed": "near.sensed",
        "force": "sensor.channel",
    },
    cells={
        "coefficients": ["planner.coefficients", "generator.coefficients"],
        "complete": ["generator.complete", "near.complete"],
        "sensed_force": ["sensor.y", "guard.force"],
    },
    input_parameters={"goal": "planner.goal", "speed": "planner.speed", "force_max": "guard.above"},
    output_values={"position": "near.sensed", "error": "near.error", "duration": "planner.duration"},
    command_lists={
        "start": [
            activate("sensor", every="1 ms"),
            activate("guard", every="1 ms"),
            execute("planner"),
            activate("generator", every="20 ms"),
            activate("near", every="20 ms"),
        ]
    },
    conditions={
        "arrived": on("near.done", returns=["position", "error", "duration"]),
        "force": on("guard.above", returns=["position"], raises=UnexpectedForce, priority=1),
    },
)
def guarded_move(
    arm: gpac.Group[Joint], /, force: gpac.Channel, goal: Sequence[float] | np.ndarray, speed: float = 0.5, force_max: float = 30.0
) -> Moved:
    """Moves the arm until it arrives or the tool meets a force. goal: rad; speed: rad/s; force_max: N."""
    ...


@gpac.verb(
    blocks={"write": lib.write_vector},
    instantiation_parameters={"tool": "write.channel"},
    input_parameters={"force": "write.u"},
    modes={"write.u": "asynchronous"},
    command_lists={"start": [wait("0.8 s"), activate("write", every="1 ms"), wait("0.3 s"), deactivate("write")]},
)
def push(tool: gpac.Channel, force: Sequence[float]) -> gpac.Report:
    """Pushes the simulated tool, after 0.8 s and for 0.3 s. force: N, in the world frame."""
    ...


@gpac.verb(
    blocks={"sensor": lib.read_vector},
    instantiation_parameters={"force": "sensor.channel"},
    command_lists={"start": [activate("sensor", every="1 ms"), wait("0.1 s"), deactivate("sensor")]},
)
def settle(force: gpac.Channel) -> gpac.Report:
    """Waits until the controller no longer reports contact at the tool."""
    ...


Push = Callable[[], Callable[[], None]]
"""Function that pushes the tool of a moving arm; it returns a function to call after the motion has ended."""


def pushed_in_simulation(device: gpac.PhysicalDevice, fast: gpac.Source, log: Account) -> Push:
    """Returns a `Push` in which a verb pushes the simulated tool."""

    def begin() -> Callable[[], None]:
        pushing = push.on(fast).asynch(device["tool.push"], force=[0.0, 60.0, 0.0])
        return lambda: log.end("push", pushing.wait(), "completed")

    return begin


def pushed_by_hand(robot: gpac.drivers.fake.ur, device: gpac.PhysicalDevice, fast: gpac.Source, pan: Joint) -> Push:
    """Returns a `Push` in which a hand pushes the tool of an arm that a controller moves, when its first joint is a third of the way."""

    def end() -> None:
        robot.press([0.0, 0.0, 0.0])
        settle.on(fast)(device["tool.force"])

    def begin() -> Callable[[], None]:
        wait_for_input(pan.sensed, above=pan.sensed.value + gpac.deg(20))
        robot.press([0.0, 60.0, 0.0])
        return end

    return begin


class JointTrace(Trace):
    """Commanded and sensed positions of the joints, collected move by move."""

    def __init__(self, arm: gpac.Group[Joint]) -> None:
        super().__init__(*(svv for joint in arm for svv in (joint.sensed, joint.commanded)))
        self._arm = arm

    def tracking_error(self) -> np.ndarray:
        """Returns each joint's maximum distance from its interpolated set-point, rad; the servo lags by one generator period."""
        errors = []
        for joint in self._arm:
            times, sensed = self.of(joint.sensed)
            set_times, commanded = self.of(joint.commanded)
            inside = (times > set_times[0] + 0.02) & (times < set_times[-1])
            errors.append(np.abs(sensed - np.interp(times - 0.02, set_times, commanded))[inside].max())
        return np.array(errors)

    def plot(self, file: Path) -> None:
        """Plots the commanded and sensed positions of all joints."""
        import matplotlib

        matplotlib.use("Agg")
        import matplotlib.pyplot as plt

        figure, axes = plt.subplots(len(self._arm), 1, sharex=True, figsize=(10, 2 * len(self._arm)), layout="constrained")
        for axis, joint in zip(axes, self._arm, strict=True):
            axis.step(*self.of(joint.commanded), where="post", label="commanded", linewidth=1)
            axis.plot(*self.of(joint.sensed), label="sensed", linewidth=1, linestyle="--")
            axis.set_ylabel(f"{joint.short_name}\n(rad)")
        axes[0].legend(loc="upper right")
        axes[-1].set_xlabel("time (s)")
        file.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(file, dpi=120)


def error_text(report: Moved) -> str:
    """Returns the largest distance of a joint from its goal, as text."""
    return f", {report.error * 1e3:.3f} mrad from the goal"


def perform(arm: gpac.Group[Joint], device: gpac.PhysicalDevice, slow: gpac.Source, fast: gpac.Source, pushing: Push, log: Account) -> None:
    """Performs the moves."""
    home = np.array(arm.values("home"))
    motion = move.on(slow)

    log.begin("home: a call that returns when the arm has arrived")
    report = motion(arm, goal=home, speed=1.0, time_limit="10 s")
    log.end("home", report, "arrived", error_text(report))

    log.begin("reach: the same call, another goal")
    report = motion(arm, goal=home + gpac.deg([40, 25, -30, -20, 15, 60]), speed=1.0, time_limit="10 s")
    log.end("reach", report, "arrived", error_text(report))

    log.begin("swing: started, and waited for later")
    instance = motion.asynch(arm, goal=home + gpac.deg([-40, 10, -40, 30, -15, -60]), speed=1.2, time_limit="10 s")
    print(f"     {instance.name} is {instance.state} while Python goes on", flush=True)
    report = instance.wait()
    log.end("swing", report, "arrived", error_text(report))

    log.begin("circuit: one instance, started three times")
    with motion.new_instance(arm) as circuit:
        for offset in ([20, 0, 0, 0, 0, 30], [0, 15, -15, 0, 20, 0], [0, 0, 0, 0, 0, 0]):
            report = circuit.start(home + gpac.deg(offset), 1.0, time_limit="10 s").wait()
            log.end(f"circuit {offset}", report, "arrived", error_text(report))

    log.begin("a guarded move that meets a force of 60 N")
    guarded = guarded_move.on({"sensor": fast, "guard": fast, "*": slow})
    goal = home + gpac.deg([60, 10, 10, 0, 0, 0])
    instance = guarded.asynch(arm, device["tool.force"], goal, speed=0.5, time_limit="10 s")
    ended = pushing()
    try:
        report = instance.wait()
        log.end("guarded move", report, "force")
    except UnexpectedForce as error:
        log.end("guarded move", error.report, "force", f", a force of {error.value:.0f} N, raised as {type(error).__name__}")
    ended()

    log.begin("recovery: the same guarded move, and home")
    report = guarded(arm, device["tool.force"], goal, speed=0.5, time_limit="10 s")
    log.end("guarded move again", report, "arrived", error_text(report))
    report = motion(arm, goal=home, speed=1.0, time_limit="10 s")
    log.end("home", report, "arrived", error_text(report))


def summary(cell: gpac.System, trace: JointTrace, arm: gpac.Group[Joint]) -> None:
    """Prints how well the joints and the interrupt sources kept to their set-points and periods."""
    print("\nGreatest tracking error (mrad)")
    for joint, error in zip(arm, trace.tracking_error(), strict=True):
        print(f"  {joint.short_name:<16} {error * 1e3:.3f}")
    print("\nInterrupt sources")
    for name, source in cell.statistics["sources"].items():
        jitter = f"jitter median < {source['jitter_median_ns'] / 1e3:.1f} us, most {source['jitter_max_ns'] / 1e3:.1f} us"
        print(f"  {name:<12} {source['firings']} firings, {jitter}, {source['overruns']} overruns")
        if source["rights_missing"]:
            print(f"  {'':<12} without real-time rights: {', '.join(source['rights_missing'])}")


def main() -> int:
    """Runs the program; returns 0 if every verb ended as expected."""
    parser = programs.parser(__doc__)
    programs.add_driver(parser)
    options = parser.parse_args()
    with programs.controller(options) as robot, programs.system("coordinated_motion", options) as cell:
        rtp = cell.processor("rtp0", core=1 if (os.cpu_count() or 1) > 1 else None)
        fast = rtp.timer("fast", period="1 ms", priority=80)
        slow = rtp.timer("slow", period="20 ms", priority=60)
        arm = gpac.robots.load("ur5e", rtp, on=fast, driver=programs.commanding(robot))
        device = cell.physical_devices["ur5e"]
        trace = JointTrace(arm)
        log = Account(trace)
        programs.studio(cell, options)
        print(f"UR5e in {options.clock} time: {', '.join(joint.short_name for joint in arm)}")
        pushing = pushed_in_simulation(device, fast, log) if robot is None else pushed_by_hand(robot, device, fast, arm.shoulder_pan)
        with arm.enabled():
            perform(arm, device, slow, fast, pushing, log)
            summary(cell, trace, arm)
        trace.save(options.trace, every=0.1)
        plot = options.output / "coordinated_motion.png"
        try:
            trace.plot(plot)
            print(f"\nPositions are drawn in {plot}")
        except OSError as error:
            print(f"\nPositions are not drawn: {error}; give a folder that can be written with --output", file=sys.stderr)
            return 1
    return log.verdict()


if __name__ == "__main__":
    programs.run(main)
