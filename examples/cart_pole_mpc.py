# SPDX-License-Identifier: Apache-2.0
"""Model-predictive control: holds a pole upright on a cart that moves to and fro, while a gusty wind pushes the pole.

The model is symbolic. The controller is a quadratic programme over the next 0.6 s; its solver is symbolic too, and CasADi generates
it as C. The plant runs in MuJoCo. The exit code is 0 only if the pole stayed up, the cart kept its rail and, in real time, no
solution took longer than its budget.

Needs `pip install 'opengpac[casadi,mujoco]'`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

import opengpac as gpac
import programs
from opengpac import activate, execute, on
from opengpac import library as lib
from opengpac.python import Condition, Input, Output
from programs import SCENES, Account, Trace

PERIOD = 0.02
STEPS = 30
FORCE_MAX = 10.0
RAIL = 0.6
"""Maximum distance of the cart from the middle of its rail, m; the rail ends at 1.2 m."""

WIND = 0.1
"""Standard deviation of the wind's torque on the pole, N.m: as much as the pole's weight exerts at 0.1 rad."""

ITERATIONS = 80
RHO_FORCE, RHO_RAIL = 0.1, 1000.0

BUDGET_S = 0.01
"""Time budget of one solution: half a period."""


def step(x: Any, u: Any) -> Any:
    """Returns the state (position, angle, speed, rate) one period later, for a cart of 1 kg and a mass of 0.2 kg on a pole of 0.5 m."""
    cart, mass, length, g = 1.0, 0.2, 0.5, 9.81

    def rates(x: Any) -> Any:
        sine, cosine = ca.sin(x[1]), ca.cos(x[1])
        speed = (u - mass * g * sine * cosine + mass * length * x[3] ** 2 * sine) / (cart + mass * sine**2)
        return ca.vertcat(x[2], x[3], speed, (g * sine - speed * cosine) / length)

    k1 = rates(x)
    k2 = rates(x + PERIOD / 2 * k1)
    k3 = rates(x + PERIOD / 2 * k2)
    k4 = rates(x + PERIOD * k3)
    return x + PERIOD / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


def linear() -> tuple[np.ndarray, np.ndarray]:
    """Returns A and B of the model linearised at the upright pole: x' = A x + B u."""
    x, u = ca.SX.sym("x", 4), ca.SX.sym("u")
    found = ca.Function("linear", [x, u], [ca.jacobian(step(x, u), x), ca.jacobian(step(x, u), u)])(np.zeros(4), 0.0)
    return np.array(found[0]), np.array(found[1])


def cost_to_go(a: np.ndarray, b: np.ndarray, q: np.ndarray, r: float) -> np.ndarray:
    """Returns the cost-to-go matrix at the end of the horizon: the solution of the Riccati equation."""
    p = q
    for _ in range(2000):
        gain = np.linalg.solve(b.T @ p @ b + r, b.T @ p @ a)
        p = q + a.T @ p @ (a - b @ gain)
    return p


@dataclass(frozen=True)
class Problem:
    """Quadratic programme in the forces f of the horizon: minimise f'Hf/2 + (F given)'f subject to |A f + S given| ≤ upper, where
    `given` is the state and the target."""

    h: np.ndarray
    f: np.ndarray
    a: np.ndarray
    s: np.ndarray
    upper: np.ndarray


def problem() -> Problem:
    """Returns the quadratic programme of the horizon with the states eliminated; only the forces remain unknown."""
    a, b = linear()
    q, r = np.diag([20.0, 20.0, 1.0, 1.0]), 0.05
    last = cost_to_go(a, b, q, r)
    h, f, rail, start = r * np.eye(STEPS), np.zeros((STEPS, 5)), np.zeros((STEPS, STEPS)), np.zeros((STEPS, 5))
    # x = free x0 + forced forces
    free, forced, target = np.eye(4), np.zeros((4, STEPS)), np.array([[0, 0, 0, 0, 1.0], *[[0.0] * 5] * 3])
    for i in range(STEPS):
        forced = a @ forced
        forced[:, i : i + 1] += b
        free = a @ free
        weight = last if i == STEPS - 1 else q
        h += forced.T @ weight @ forced
        f += forced.T @ weight @ (np.hstack([free, np.zeros((4, 1))]) - target)
        rail[i], start[i, :4] = forced[0], free[0]
    return Problem(h, f, np.vstack([np.eye(STEPS), rail]), np.vstack([np.zeros((STEPS, 5)), start]), np.repeat([FORCE_MAX, RAIL], STEPS))


def controller() -> ca.Function:
    """Returns the control law, measured state and target → force: operator splitting (Stellato and others, OSQP, 2020) with a fixed
    number of iterations, so that every solution takes the same time.

    Each solution starts from the forces, the constrained values z and the multipliers y of the previous one.
    """
    p = problem()
    rho = np.repeat([RHO_FORCE, RHO_RAIL], STEPS)
    solve = np.linalg.inv(p.h + 1e-6 * np.eye(STEPS) + p.a.T @ (rho[:, None] * p.a))
    names = ["position", "angle", "speed", "rate", "target"]
    inputs = [ca.MX.sym(name) for name in names]
    forces, z, y = ca.MX.sym("forces", STEPS), ca.MX.sym("z", 2 * STEPS), ca.MX.sym("y", 2 * STEPS)
    cost, offset = ca.MX.sym("cost", STEPS), ca.MX.sym("offset", 2 * STEPS)
    tried = ca.mtimes(solve, 1e-6 * forces - cost + ca.mtimes(p.a.T, rho * z - y))
    relaxed = 1.6 * ca.mtimes(p.a, tried) - 0.6 * z
    split = ca.fmin(ca.fmax(relaxed + y / rho, -p.upper - offset), p.upper - offset)
    once = ca.Function("once", [forces, z, y, cost, offset], [1.6 * tried - 0.6 * forces, split, y + rho * (relaxed - split)])
    found = [forces, z, y]
    for _ in range(ITERATIONS):
        found = once(*found, ca.mtimes(p.f, ca.vertcat(*inputs)), ca.mtimes(p.s, ca.vertcat(*inputs)))
    force = ca.fmin(ca.fmax(found[0][0], -FORCE_MAX), FORCE_MAX)
    return ca.Function(
        "mpc",
        [*inputs, forces, z, y],
        [force, ca.fabs(inputs[1]) > 0.5, *found],
        [*names, "forces", "z", "y"],
        ["force", "fallen", "next_forces", "next_z", "next_y"],
    )


def block() -> gpac.CasadiBlock:
    """Returns the law as a function block with five inputs with units, a force, a condition, and the warm start as its state."""
    return gpac.casadi(
        controller(),
        inputs={
            name: Input(what, unit, mode="asynchronous")
            for name, what, unit in (
                ("position", "where the cart is", "m"), ("angle", "of the pole from upright", "rad"), ("speed", "of the cart", "m/s"),
                ("rate", "of the pole", "rad/s"), ("target", "where the cart is to be", "m"),
            )
        },
        outputs={"force": Output("force at the cart", "N"), "fallen": Condition("the pole is more than 0.5 rad from upright")},
        states={"forces": "next_forces", "z": "next_z", "y": "next_y"},
        doc="Model-predictive control of a pole on a cart.",
    )  # fmt: skip


def hold(law: gpac.CasadiBlock, seconds: float, budget: float | None) -> gpac.Verb[..., Any]:
    """hold(position_channel, …, motor, gust, position, angle, force): holds the pole against the wind for `seconds`.

    A solution that exceeds the `budget` is a fault.
    """
    reads = ["position", "angle", "speed", "rate"]
    fast = [*(f"read_{name}" for name in reads), "wave", "wind", "push", "move", "clock"]
    return gpac.Verb(
        "hold",
        doc="Holds a pole upright on a cart that goes to and fro.",
        blocks={
            **{f"read_{name}": lib.block("read_channel") for name in reads},
            "wave": lib.block("signal_generator")(shape=2, amplitude=0.4, frequency=0.1),
            "wind": lib.block("noise")(deviation=WIND, seed=3),
            "push": lib.block("write_channel"),
            "law": law,
            "move": lib.block("write_channel"),
            "clock": lib.block("time_limit")(limit=seconds),
        },
        instantiation_parameters={
            **{f"{name}_channel": f"read_{name}.channel" for name in reads},
            "motor": "move.channel",
            "gust": "push.channel",
            "position": ["read_position.y", "law.position"],
            "angle": ["read_angle.y", "law.angle"],
            "force": ["law.force", "move.u"],
        },
        cells={
            "speed": ["read_speed.y", "law.speed"],
            "rate": ["read_rate.y", "law.rate"],
            "target": ["wave.y", "law.target"],
            "pushed": ["wind.y", "push.u"],
        },
        command_lists={
            "start": [
                *(execute(label) for label in fast[:4]),
                *(activate(label, every="1 ms") for label in fast),
                activate("law", every="20 ms", budget=budget),
            ]
        },
        modes={"move.u": "asynchronous", "push.u": "asynchronous"},
        conditions={"over": on("clock.expired", returns=[]), "fallen": on("law.fallen")},
    )


def main() -> int:
    """Runs the program; returns 0 if the pole stayed up and every solution kept its budget."""
    parser = programs.parser(__doc__)
    parser.add_argument("--seconds", type=float, default=60.0, help="how long the pole is held")
    options = parser.parse_args()
    law = block()
    with programs.system("cart_pole", options) as cell:
        rtp = cell.processor("rtp0")
        fast, slow = rtp.timer("fast", period="1 ms", priority=80), rtp.timer("slow", period="20 ms", priority=70)
        plant = rtp.physical_device("plant", gpac.drivers.mujoco(SCENES / "cart_pole.xml"), exchange=fast)
        past = round(options.seconds * 1000) + 1000
        position = cell.svv("position", unit="m", history=past)
        angle, force = cell.svv("angle", unit="rad", history=past), cell.svv("force", unit="N", history=past)
        trace, account = Trace(position, angle, force), Account()
        account.begin(f"hold the pole for {options.seconds:g} s; work vectors of the law: {law.work_bytes >> 10} kB")
        cell.block_times(slow, during="1 h")
        cart, pole = plant["cart"], plant["pole"]
        channels = cart.position, pole.position, cart.velocity, pole.velocity, cart.effort, pole.effort
        # Under the virtual clock nothing depends on real time, so other load on this machine must not count as a fault.
        budget = None if cell.virtual else BUDGET_S
        instance = hold(law, options.seconds, budget).on({"law": slow, "*": fast}).new_instance(*channels, position, angle, force)
        instance.start()
        report = instance.wait()
        account.end("hold", report, "over")
        trace.collect()
        places, angles, forces = (np.abs(trace.of(svv)[1]).max() for svv in (position, angle, force))
        account.expect("the pole stays up", angles < 0.5, f"at most {angles:.3f} rad from upright")
        account.expect("the cart keeps its rail", places < 1.0, f"at most {places:.3f} m from the middle")
        account.expect("the force keeps its limit", forces <= FORCE_MAX + 1e-9, f"at most {forces:.2f} N")
        seen = cell.statistics["sources"][slow.name]["blocks"]
        worst, samples = max(block["max_ns"] for block in seen) * 1e-9, sum(block["samples"] for block in seen)
        within = budget is None or worst <= budget
        account.expect("the law keeps its budget", within, f"at most {worst * 1e3:.2f} ms of {BUDGET_S * 1e3:g} ms, {samples} solutions")
        trace.save(options.trace, every=0.1)
    return account.verdict()


if __name__ == "__main__":
    programs.run(main)
