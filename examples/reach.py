# SPDX-License-Identifier: Apache-2.0
"""A learned policy: a UR5e reaches for goals that a camera sees, with a network trained by `reach_training.py` under the virtual clock.

The network runs at 50 Hz and outputs joint speeds. A generator turns these into set-points at 1 kHz within acceleration and jerk
limits, and the servos follow them within their own limits. The policy ends if it meets a situation outside its training: with
`out_of_distribution` if the goal is too far away, with `stale` if the camera is silent. A guard verb then takes over and brings the
arm to rest. The exit code is 0 only if all this happens.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np

import opengpac as gpac
import programs
from opengpac import activate, execute, on
from opengpac import library as lib
from opengpac.robots import Joint
from programs import BLOCKS, Account, Trace

NETWORK = Path(__file__).parent / "policies" / "reach.onnx"
"""Trained network, made by `reach_training.py`; its metadata contain the seed."""

EVERY = "20 ms"
"""Interval at which the policy runs."""

JOINTS = ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"]
HOME = np.array([0.0, -np.pi / 2, np.pi / 2, -np.pi / 2, -np.pi / 2, 0.0])
RATE_MAX = 1.0
"""Maximum joint speed that the policy can request, rad/s."""

TOLERANCE = 0.01
"""Maximum distance of the tip from the goal on each axis, m."""

SPREAD = np.array([0.2, 0.25, 0.2])
"""Maximum distance of a goal from the tip's home position on each axis, m."""

OBSERVATIONS = [
    gpac.Term("q", names=JOINTS, unit="rad", offset=HOME, within=(HOME - 1.6, HOME + 1.6), doc="joint positions"),
    gpac.Term("error", size=3, unit="m", within=(-0.7, 0.7), clip=(-0.1, 0.1), scale=10.0, doc="way from the tip to the goal"),
]
ACTIONS = gpac.Term("rate", names=JOINTS, unit="rad/s", scale=RATE_MAX, clip=(-RATE_MAX, RATE_MAX), doc="joint speeds")

_SEES = {"arm.sensed": ["kinematics.q"], "goal": ["to_goal.goal"], "error": ["to_goal.error"], "tip": ["to_goal.tip"]}
_MOVES = {"arm.commanded": ["generator.start", "generator.setpoint"], "arm.commanded_velocity": ["generator.start_velocity"]}
_LIMITS = {
    "chain": gpac.input("kinematics.chain", member="arm.chain"),
    # Less than the joints can do: the servos smooth their set-points, and reach 1 % more.
    "acceleration": gpac.input("generator.acceleration", default="90 %", within=(1e-6, "arm.max_acceleration")),
    "arm.max_jerk": ["generator.jerk"],
    "arm.position_min": ["generator.position_min"],
    "arm.position_max": ["generator.position_max"],
}


def _blocks(code: gpac.Module) -> dict[str, Any]:
    generator = lib.block("velocity_generator")(lead=0.001)
    return {"kinematics": lib.block("forward_kinematics"), "to_goal": code.to_goal, "generator": generator}


def moved(code: gpac.Module) -> gpac.Verb[..., Any]:
    """moved(arm, goal, error, tip, rate): moves the arm's joints at the speeds in `rate`, without a policy. rad/s."""
    return gpac.Verb(
        "moved",
        doc="Moves joints at speeds that are stored from outside, and tells the way from the tip to a goal.",
        blocks=_blocks(code),
        objects={"arm": gpac.each(Joint)},
        instantiation_parameters={**_SEES, **_MOVES, "rate": "generator.velocity"},
        cells={"pose": ["kinematics.pose", "to_goal.pose"]},
        input_parameters=_LIMITS,
        modes={"kinematics.q": "asynchronous"},
        command_lists={"moving": [activate("kinematics", every=EVERY), activate("to_goal"), activate("generator", every="1 ms")]},
    )


def environment(name: str = "reach", seconds: float = 4.0) -> Any:
    """Returns the Gymnasium environment in which the policy is trained: the arm with its servos, generator and kinematics."""

    def setup(cell: gpac.System) -> gpac.gym.Task:
        fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
        arm = gpac.robots.load("ur5e", on=fast)
        goal, error, tip = (cell.svv(what, "double[3]", unit="m") for what in ("goal", "error", "tip"))
        rate = cell.svv("rate", "double[6]", unit="rad/s")
        moving = moved(cell.download(BLOCKS / "reach.c")).on(fast).new_instance(arm, goal, error, tip, rate)
        middle = arm.forward(HOME).position

        def begin(rng: np.random.Generator) -> dict[str, Any]:
            return {"goal": middle + rng.uniform(-SPREAD, SPREAD), "ur5e": HOME + rng.uniform(-0.2, 0.2, 6)}

        ports = {"q": [joint.sensed for joint in arm], "goal": goal, "error": error, "tip": tip, "rate": rate}
        return gpac.gym.Task(ports=ports, devices=arm, instances=[moving], begin=begin)

    return gpac.gym.Environment(
        setup, observations=OBSERVATIONS, actions=ACTIONS, every=EVERY, seconds=seconds, name=name,
        reward=lambda values: -float(np.abs(values["error"]).max()),
    )  # fmt: skip


def policy() -> gpac.Policy:
    """Returns the trained network as a block; the joints and interval in its file are compared with those declared here."""
    return gpac.policy(NETWORK, inputs={"obs": OBSERVATIONS}, outputs={"actions": ACTIONS}, every=EVERY, age_max="100 ms")


def reach(code: gpac.Module) -> gpac.Verb[..., Any]:
    """reach(arm, goal, error, tip, observed): the policy moves the tip to the goal; `arrived` when the arm is at rest there."""
    return gpac.Verb(
        "reach",
        doc="Moves the tip of an arm to a goal by a learned policy.",
        blocks=_blocks(code) | {"policy": policy(), "near": lib.block("in_position")(n=3), "hold": lib.block("flag")(value=True)},
        objects={"arm": gpac.each(Joint)},
        instantiation_parameters={
            "arm.sensed": [*_SEES["arm.sensed"], "policy.q"],
            "goal": [*_SEES["goal"], "near.goal"],
            "error": [*_SEES["error"], "policy.error"],
            "tip": [*_SEES["tip"], "near.sensed"],
            "observed": "policy.observed",
            **_MOVES,
        },
        cells={
            "pose": ["kinematics.pose", "to_goal.pose"],
            "rate": ["policy.rate", "generator.velocity"],
            "holding": ["hold.y", "generator.holding"],
        },
        input_parameters={**_LIMITS, "tolerance": gpac.input("near.tolerance", default=TOLERANCE)},
        output_values={"error": "near.error"},
        modes={"kinematics.q": "asynchronous"},
        command_lists={
            "reaching": [
                activate("kinematics", every=EVERY),
                activate("to_goal"),
                activate("policy", every=EVERY),
                activate("near", every=EVERY),
                activate("generator", every="1 ms"),
            ],
            # The generator continues, and brings the arm to rest from its present motion.
            "resting": [activate("generator", every="1 ms"), execute("hold")],
        },
        initial="reaching",
        conditions={
            "there": on("near.done", during="reaching"),
            "arrived": on("generator.held", returns=["error"], during="resting"),
            "out_of_distribution": on("policy.out_of_distribution", during="reaching"),
            "stale": on("policy.stale", during="reaching"),
        },
        transitions={("reaching", "there"): "resting"},
    )


def guarded_reach(code: gpac.Module) -> gpac.Verb[..., Any]:
    """Returns the same verb with a guard: `motion.stop` takes over, in the same firing, when the policy must not continue."""
    return gpac.compose(
        "guarded_reach",
        {"reach": reach(code), "guard": gpac.motion.stop},
        transitions={("reach", why): "guard" for why in ("out_of_distribution", "stale", "time_limit")},
    )


def watching(code: gpac.Module) -> gpac.Verb[..., Any]:
    """watching(target, goal, observed): simulates a camera that sees the goal 50 times a second, until it is halted."""
    return gpac.Verb(
        "watching",
        blocks={"camera": code.camera},
        instantiation_parameters={"target": "camera.target", "goal": "camera.goal", "observed": "camera.observed"},
        command_lists={"start": [activate("camera", every=EVERY)]},
    )


class Work:
    """Cell with an arm, a camera and the policy."""

    def __init__(self, cell: gpac.System) -> None:
        fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
        cell.place({"*": fast})
        self.cell = cell
        self.arm = gpac.robots.load("ur5e", on=fast)
        self.middle = np.array(self.arm.forward(HOME).position)
        code = cell.download(BLOCKS / "reach.c")
        self.target = cell.svv("target", "double[3]", unit="m", initial=self.middle)
        self.goal, self.error, self.tip = (cell.svv(what, "double[3]", unit="m", history=1000) for what in ("goal", "error", "tip"))
        self.observed = cell.svv("observed", "int64_t")
        self.camera = watching(code).new_instance(self.target, self.goal, self.observed)
        self.reaching = guarded_reach(code).new_instance(self.arm, self.goal, self.error, self.tip, self.observed)

    def reach(self, goal: np.ndarray, time_limit: str = "6 s") -> gpac.Report:
        """Lets the policy reach for a goal that the camera sees."""
        self.target.value = goal
        self._let_it_see()
        return self.reaching.start(time_limit=time_limit).wait()

    def reach_unseen(self, goal: np.ndarray) -> gpac.Report:
        """Does the same with a camera that falls silent."""
        self.target.value = goal
        self._let_it_see()
        self.reaching.start(time_limit="6 s")
        self.camera.halt()
        return self.reaching.wait()

    def _let_it_see(self) -> None:
        """Waits for two pictures of the camera; a policy started earlier would find itself at the previous goal."""
        if self.cell.virtual:
            self.cell.advance("40 ms")
        else:
            time.sleep(0.04)


def accelerations(arm: gpac.Group[Joint]) -> np.ndarray:
    """Returns the maximum acceleration commanded to each servo within its history, from references 1 ms apart, rad/s²."""
    found = []
    for joint in arm:
        rows = joint.reference.history[:]
        even = np.abs(np.diff(rows["time"]) - 1e-3) < 1e-9
        steps = np.diff(rows["value"], 2)[even[1:] & even[:-1]] / 1e-6
        found.append(float(np.abs(steps).max(initial=0.0)))
    return np.array(found)


def perform(work: Work, account: Account) -> Trace:
    """Reaches for three goals, then for one that is too far away, then with a camera that falls silent."""
    trace = Trace(work.tip, work.arm["elbow"].commanded)
    rng = np.random.default_rng(2026)
    work.camera.start()
    for number in range(3):
        goal = work.middle + rng.uniform(-SPREAD, SPREAD)
        account.begin(f"reaches for {np.round(goal, 3).tolist()} m")
        account.end(f"goal {number + 1}", work.reach(goal), "arrived")
        trace.collect()
    account.begin("a goal two metres away: the guard takes over")
    account.end("too far", work.reach(work.middle + np.array([2.0, 0.0, 0.0])), "stopped")
    account.begin("the camera falls silent: the guard takes over")
    account.end("silent camera", work.reach_unseen(work.middle + SPREAD), "stopped")
    trace.collect()
    fastest, limits = accelerations(work.arm), np.array([joint.max_acceleration for joint in work.arm])
    account.expect(
        "keeps to the acceleration at 1 ms", bool((fastest <= limits * 1.001).all()), f"{fastest.max():.2f} of {limits.min():.2f} rad/s^2"
    )
    return trace


def main() -> int:
    """Runs the program; returns 0 if the policy reached its goals and the guard took over when it should."""
    options = programs.parser(__doc__).parse_args()
    account = Account()
    with programs.system("reach", options) as cell:
        work = Work(cell)
        with work.arm.enabled():
            perform(work, account).save(options.trace, every=0.05)
    return account.verdict()


if __name__ == "__main__":
    programs.run(main)
