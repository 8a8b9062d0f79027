# SPDX-License-Identifier: Apache-2.0
"""Makes the pictures of the README: `python docs/pictures/make.py`, from a run in real time; `--virtual` for simulated time."""

import sys
from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import numpy as np

import opengpac as gpac
from opengpac import library

matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "opengpac", "font.family": "sans-serif", "font.size": 9})

FOLDER = Path(__file__).parent
GOALS = ([-40, -65, 100, -120, -70, 45], [0, -90, 90, -90, -90, 0])
SLOW = "planner (once)  →  generator  →  in_position\na condition, done, ends the verb"
FAST = "6 × joint:  read  →  servo  →  write\na verb of its own, started by enable()"
BLUE, ORANGE, GREEN, GREY = "#2c6fbb", "#d9782d", "#4b8b3b", "#666666"


def motion(clock: str) -> None:
    """A UR5e makes two coordinated moves: what was commanded, what was sensed, and the difference."""
    arm = gpac.robots.load("ur5e", clock=clock)
    with arm.system:
        arm.enable()
        moving = gpac.robots.move.new_instance(arm)
        for goal in GOALS:
            print(moving.start(goal=gpac.deg(goal), speed=0.8).wait())
        rows = [(joint.short_name, joint.commanded.history[:], joint.sensed.history[:]) for joint in arm]
    figure, (above, below) = plt.subplots(2, 1, figsize=(8, 4.6), height_ratios=(3, 1), sharex=True, layout="constrained")
    for name, commanded, sensed in rows:
        (line,) = above.plot(sensed["time"], np.degrees(sensed["value"]), lw=1.6, label=name)
        above.step(commanded["time"], np.degrees(commanded["value"]), "k:", lw=0.9, where="post")
        # The servo reaches each set-point one period after it was stored, on a straight line.
        reference = np.interp(sensed["time"] - 0.020, commanded["time"], commanded["value"])
        below.plot(sensed["time"], np.degrees(reference - sensed["value"]), lw=0.8, color=line.get_color())
    above.plot([], [], "k:", lw=0.9, label="commanded, every 20 ms")
    above.set_ylabel("position, °")
    below.set(ylabel="servo error, °", xlabel="time, s")
    above.legend(ncols=4, fontsize=8, loc="upper center", frameon=False)
    above.set_ylim(-145, 175)
    for axes in (above, below):
        axes.grid(alpha=0.3)
        axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(FOLDER / "motion.png", dpi=110)


def box(axes: plt.Axes, x: float, y: float, width: float, title: str, text: str, colour: str, height: float = 0.8) -> None:
    """A box with a title and what it does; x and y are its lower left corner."""
    axes.add_patch(plt.Rectangle((x, y), width, height, facecolor=colour + "18", edgecolor=colour, lw=1.3))
    axes.text(x + 0.1, y + height - 0.2, title, weight="bold", va="center", color=colour)
    axes.text(x + 0.1, y + (height - 0.3) / 2, text, va="center", fontsize=8)


def arrow(axes: plt.Axes, begin: tuple[float, float], end: tuple[float, float], text: str = "", dx: float = 0.08, dy: float = 0.0) -> None:
    """An arrow with a word beside its middle."""
    axes.annotate("", end, begin, arrowprops={"arrowstyle": "-|>", "color": GREY, "lw": 1.2, "shrinkA": 0, "shrinkB": 0})
    axes.text((begin[0] + end[0]) / 2 + dx, (begin[1] + end[1]) / 2 + dy, text, fontsize=7.5, color=GREY, va="center")


def verb_to_torque() -> None:
    """How a call of a verb becomes a torque."""
    figure, axes = plt.subplots(figsize=(9, 5.4), layout="constrained")
    box(axes, 0, 5.1, 4.3, "Python: the programming system", "move(arm, goal, speed=0.5) returns a report, or raises", BLUE)
    box(axes, 0, 3.9, 4.3, "model", "checks types, units, rates, cover, writers → a plan", BLUE)
    box(axes, 0, 2.7, 4.3, "supervisor", "installs the plan; starts, watches and ends the verb", BLUE)
    box(axes, 5.6, 4.5, 4.9, "interrupt source 'slow': every 20 ms", SLOW, ORANGE, 1.1)
    box(axes, 5.6, 2.4, 4.9, "interrupt source 'fast': every 1 ms", FAST, GREEN, 1.1)
    box(axes, 5.6, 0.6, 4.9, "physical device", "MuJoCo, or a machine: positions in, torques out", GREY)
    box(axes, 0, 0.6, 4.3, "state vector variables", "commanded, goal, sensed: value, number, time, history", GREY)
    arrow(axes, (1.2, 5.1), (1.2, 4.7), "definition, arguments")
    arrow(axes, (1.2, 3.9), (1.2, 3.5), "plan")
    arrow(axes, (3.6, 3.5), (3.6, 5.1))
    axes.text(3.52, 3.7, "end report", fontsize=7.5, color=GREY, va="center", ha="right")
    arrow(axes, (4.3, 3.2), (5.6, 4.8), "tables, scripts", -0.62, 0.42)
    arrow(axes, (4.3, 3.0), (5.6, 3.0))
    arrow(axes, (7.2, 4.5), (7.2, 3.5), "six set-points: one publication,\nwait-free")
    arrow(axes, (9.9, 3.5), (9.9, 4.5), "sensed", 0.06)
    arrow(axes, (7.2, 2.4), (7.2, 1.4), "torque, N.m")
    arrow(axes, (9.9, 1.4), (9.9, 2.4), "position", 0.06)
    arrow(axes, (5.6, 2.55), (4.3, 1.3), "published at the\nend of a firing", -0.95, 0.3)
    arrow(axes, (0.6, 1.4), (0.6, 2.7))
    axes.text(0.7, 2.0, "read, history, snapshots", fontsize=7.5, color=GREY, va="center")
    axes.set(xlim=(-0.1, 10.75), ylim=(0.4, 6.05))
    axes.axis("off")
    figure.savefig(FOLDER / "verb_to_torque.svg", metadata={"Date": None})
    if "--preview" in sys.argv:
        figure.savefig(sys.argv[sys.argv.index("--preview") + 1], dpi=100)


def definitions() -> None:
    """What a notebook shows of a graph and of a verb."""
    smooth = gpac.Graph("smooth",
        blocks={"gain": library.gain(k=2.0), "filter": library.lowpass(alpha=0.3)},
        inputs={"u": "gain.u"}, outputs={"y": "filter.y"}, cells={"scaled": ["gain.y", "filter.u"]})
    loop = gpac.Graph("loop",
        blocks={"pid": library.pid(kp=2.0), "limit": library.limit(high=1.0), "plant": library.first_order_lag(time=0.2), "sensor": smooth},
        inputs={"goal": "pid.setpoint"}, outputs={"position": ["plant.y", "sensor.u"]},
        cells={"effort": ["pid.effort", "limit.u"], "limited": ["limit.y", "plant.u"], "measured": ["sensor.y", "pid.measured"]},
        modes={"pid.measured": "asynchronous"})
    loop.save_svg(FOLDER / "graph.svg")
    gpac.motion.move_linear.save_svg(FOLDER / "verb.svg")


definitions()
motion("virtual" if "--virtual" in sys.argv else "monotonic")
verb_to_torque()
