# SPDX-License-Identifier: Apache-2.0
"""A servo into which a digital filter is inserted by editing only its graph, to show its effect on a noisy encoder.

The elbow of a small arm swings. Its encoder is noisy, so the servo shakes the motor. The same servo with a filter from the library
between encoder and controller is another graph; nothing else changes. The exit code is 0 only if the filter quietens the motor.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np

import opengpac as gpac
import programs
from opengpac import activate, on, robots
from opengpac import library as lib
from programs import BLOCKS, Account, Trace

TWO_JOINT = Path(robots.__file__).parent / "two_joint.xml"

SECONDS = 2.0
"""Time for which each servo is observed."""


def servo(code: gpac.Module) -> gpac.Graph:
    """Returns the servo as a data flow graph: encoder, controller, motor."""
    return gpac.Graph(
        "servo",
        doc="Keeps a joint at its set-point.",
        blocks={
            "encoder": code.noisy_encoder,
            "pid": lib.block("pid")(kp=60.0, ki=50.0, kd=4.0, limit=20.0),
            "motor": lib.block("write_channel"),
        },
        inputs={"setpoint": "pid.setpoint", "load": "pid.feedforward"},
        outputs={"angle": "encoder.truth", "effort": ["pid.effort", "motor.u"]},
        cells={"measured": ["encoder.y", "pid.measured"]},
        modes={"pid.setpoint": "asynchronous"},
    )


def filtered(graph: gpac.Graph) -> gpac.Graph:
    """Returns the same servo with a filter between encoder and controller. This line is the only change."""
    return graph.insert("filter", lib.block("second_order")(frequency=20.0), between=("encoder.y", "pid.measured"))


def swing(graph: gpac.Graph) -> gpac.Verb[..., Any]:
    """swing(position, bias, effort, setpoint, angle, torque): swings a joint with the given servo for `SECONDS`."""
    return gpac.Verb(
        "swing",
        doc="Swings a joint.",
        blocks={
            "wave": lib.block("signal_generator")(amplitude=0.4, frequency=0.5),
            "weight": lib.block("read_channel"),
            "servo": graph,
            "clock": lib.block("time_limit")(limit=SECONDS),
        },
        instantiation_parameters={
            "position": "servo.encoder.channel",
            "bias": "weight.channel",
            "effort": "servo.motor.channel",
            "setpoint": ["wave.y", "servo.setpoint"],
            "angle": "servo.angle",
            "torque": "servo.effort",
        },
        cells={"load": ["weight.y", "servo.load"]},
        command_lists={"start": [activate(label, every="1 ms") for label in ("wave", "weight", "servo", "clock")]},
        conditions={"over": on("clock.expired", returns=[])},
    )


class Figures:
    """Effect of the noise on a servo: the shaking of the motor, and the distance of the joint from its set-point."""

    def __init__(self, rows: np.ndarray) -> None:
        setpoint, angle, torque = rows
        if len(torque) < 4:
            sys.exit("nothing was recorded")
        later = slice(len(torque) // 2, None)
        self.shaking = float(np.std(np.diff(torque[later])))
        self.error = float(np.sqrt(np.mean((setpoint - angle)[later] ** 2)))

    def __str__(self) -> str:
        return f"the torque shakes by {self.shaking:.3f} N.m from one ms to the next, the error is {self.error * 1e3:.2f} mrad"


def plot(file: Path, rows: dict[str, np.ndarray]) -> None:
    """Plots the torque and the angle, without and with the filter."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, 1, sharex=True, figsize=(10, 6), layout="constrained")
    for name, (setpoint, angle, torque) in rows.items():
        times = np.arange(len(torque)) * 1e-3
        axes[0].plot(times, torque, label=name, linewidth=0.7)
        axes[1].plot(times, 1e3 * (setpoint - angle), label=name, linewidth=0.7)
    axes[0].set_ylabel("torque (N.m)")
    axes[1].set_ylabel("error (mrad)")
    axes[1].set_xlabel("time (s)")
    axes[0].legend(loc="upper right")
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file, dpi=120)


def main() -> int:
    """Runs the program; returns 0 if the filter quietens the motor and the joint follows its set-point."""
    options = programs.parser(__doc__).parse_args()
    with programs.system("filtered_servo", options) as cell:
        rtp = cell.processor("rtp0")
        fast = rtp.timer("fast", period="1 ms", priority=80)
        machine = rtp.physical_device("arm", gpac.drivers.mujoco(TWO_JOINT), exchange=fast)
        setpoint, angle = (cell.svv(name, unit="rad", history=5000) for name in ("setpoint", "angle"))
        torque = cell.svv("torque", unit="N.m", history=5000)
        trace, account = Trace(setpoint, angle, torque), Account()
        plain = servo(cell.download(BLOCKS / "noise.c"))
        figures: dict[str, Figures] = {}
        rows: dict[str, np.ndarray] = {}
        for name, graph in (("without a filter", plain), ("with a filter", filtered(plain))):
            account.begin(f"swing {name}: {', '.join(graph.blocks)}")
            joint = machine["elbow"]
            report = swing(graph).on(fast)(joint.position, joint.bias, joint.effort, setpoint, angle, torque)
            rows[name] = np.array([svv.history[-1500:]["value"] for svv in (setpoint, angle, torque)])
            figures[name] = Figures(rows[name])
            account.end(name, report, "over", f", {figures[name]}")
            trace.collect()
        before, after = figures.values()
        account.expect("the motor is quiet", after.shaking < before.shaking / 5, f"{before.shaking / after.shaking:.1f} times quieter")
        account.expect("the joint follows", after.error < 2.0 * before.error, f"{after.error * 1e3:.2f} mrad")
        trace.save(options.trace, every=0.05)
    plot(options.output / "filtered_servo.png", rows)
    return account.verdict()


if __name__ == "__main__":
    programs.run(main)
