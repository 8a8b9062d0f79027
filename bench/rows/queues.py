# SPDX-License-Identifier: Apache-2.0
"""Queues of moves: the duration of random programs compared with ruckig's (from rest to rest) and with the optimum on the same path, by
`copp`'s TOPP3 with the limits of speed, acceleration and jerk; and the time that a set-point takes."""

from __future__ import annotations

import importlib
import json
import subprocess
from collections.abc import Iterator
from importlib.util import find_spec
from math import comb
from typing import Any

import numpy as np
from lines import Line, median, time

from .kernel import example

STEPS = 200
"""Minimum number of points of a path at which TOPP3 limits the motion."""
SHORTEST = 1e-9
"""Fraction of the path's length below which a span is skipped."""
REFINEMENTS = 4
"""Number of times that TOPP3 linearizes the limit of jerk again."""


def measure(quick: bool) -> Iterator[Line]:
    """Yields the rows; those of a package that is not installed are without a figure."""
    printed = subprocess.run([example("library", "queues"), "2" if quick else "25"], check=True, stdout=subprocess.PIPE, text=True).stdout
    programs = [json.loads(line) for line in printed.splitlines()]
    of = {kind: [program for program in programs if program["kind"] == kind] for kind in ("line", "joints", "tool")}
    yield _setpoint(programs)
    yield _row("one move of the joints, from rest to rest", of["line"], _ruckig, "ruckig", 1.01)
    yield _row("five moves of the joints, blended", of["joints"], _optimum, "TOPP3", 1.10)
    yield _row("five lines of the tool, blended", of["tool"], _optimum, "TOPP3", 1.10)
    ratios = [program["duration"] / program["stopped"] for kind in ("joints", "tool") for program in of[kind]]
    yield Line(
        "queue", "blended moves, to the same moves with stops", "", "", max(ratios), f"{max(ratios):.3f}", 1.0, "≤ 1",
        f"the worst of {len(ratios)} programs, median {median(ratios):.2f}",
    )  # fmt: skip


def _setpoint(programs: list[dict[str, Any]]) -> Line:
    value = median(float(program["setpoint_ns"]) for program in programs)
    return Line(
        "queue",
        "a set-point of 6 or 7 joints",
        time(value),
        "",
        value,
        time(value),
        4_000.0,
        "≤ 4 µs",
        f"median of {len(programs)} programs",
    )


def _row(what: str, programs: list[dict[str, Any]], peer: Any, name: str, bar: float) -> Line:
    """Returns the row of the worst ratio of our duration to a peer's."""
    package = {"ruckig": "ruckig", "TOPP3": "copp_py"}[name]
    if find_spec(package) is None:
        return Line("queue", f"{what}, to {name}", note=f"not measured: the package {package} is not installed")
    found = [(program["duration"], peer(program)) for program in programs]
    ratios = [duration / best for duration, best in found if best is not None]
    if not ratios:
        return Line("queue", f"{what}, to {name}", note=f"not measured: {name} solved none of {len(found)} programs")
    unsolved = f", {len(found) - len(ratios)} not solved by {name}" if len(ratios) < len(found) else ""
    return Line(
        "queue", f"{what}, to {name}", "", "", max(ratios), f"{max(ratios):.3f}", bar, f"≤ {bar}",
        f"the worst of {len(ratios)} programs, median {median(ratios):.3f}{unsolved}",
    )  # fmt: skip


def _ruckig(program: dict[str, Any]) -> float:
    """Returns the duration of the straight move by ruckig, with all joints in phase."""
    ruckig: Any = importlib.import_module("ruckig")

    points = np.array(program["pieces"][0]["spans"][0]["points"])
    n = len(points)
    asked, found = ruckig.InputParameter(n), ruckig.Trajectory(n)
    asked.current_position, asked.target_position = points[:, 0].tolist(), points[:, -1].tolist()
    asked.max_velocity, asked.max_acceleration = [program["speed"]] * n, [program["acceleration"]] * n
    asked.max_jerk, asked.synchronization = [program["jerk"]] * n, ruckig.Synchronization.Phase
    ruckig.Ruckig(n).calculate(asked, found)
    return found.duration


def _optimum(program: dict[str, Any]) -> float | None:
    """Returns the shortest duration of a program on its path, including its stops; `None` if the solver fails."""
    copp: Any = importlib.import_module("copp_py")
    spans: list[list[dict[str, Any]]] = [[]]
    for piece in program["pieces"]:
        spans[-1] += piece["spans"]
        if piece["stops"]:
            spans.append([])
    try:
        return sum(_topp3(copp, path, program) for path in spans if path)
    except copp.CoppError:
        return None


def _topp3(copp: Any, spans: list[dict[str, Any]], program: dict[str, Any]) -> float:
    stations, derivatives = _stations(spans)
    count, n = len(stations), derivatives.shape[2]
    robot = copp.Robot(n, capacity=count)
    robot.append_s(stations)
    robot.set_q(derivatives[0], derivatives[1], derivatives[2], 0, dddq=derivatives[3])
    most = {of: np.full(n, program[of]) for of in ("speed", "acceleration", "jerk")}
    robot.add_velocity_limits(most["speed"], -most["speed"], start_idx_s=0, length=count)
    robot.add_acceleration_limits(most["acceleration"], -most["acceleration"], start_idx_s=0, length=count)
    problem = copp.solver.topp2_ra.Problem(robot.constraints, idx_s_interval=(0, count - 1), a_boundary=(0.0, 0.0))
    squared = copp.solver.topp2_ra.solve(problem, copp.solver.topp2_ra.Options())
    robot.add_jerk_limits(most["jerk"], -most["jerk"], start_idx_s=0, length=count)
    again: dict[str, Any] = {}
    duration = float("nan")
    for _ in range(REFINEMENTS):
        problem = copp.solver.topp3_socp.Problem(
            robot.constraints, squared, idx_s_start=0, a_boundary=(0.0, 0.0), b_boundary=(0.0, 0.0), num_stationary_max=1, **again
        )
        profile = copp.solver.topp3_socp.solve(problem, copp.solver.topp3_socp.Options())
        squared, again = np.array(profile.a), {"b_linearization": np.array(profile.b)}
        duration = float(copp.interpolation.s_to_t_topp3(stations, profile, 0.0)[0])
    return duration


def _stations(spans: list[dict[str, Any]]) -> tuple[np.ndarray, np.ndarray]:
    """Returns points along a path of polynomials in Bernstein form, and there the positions with their first three derivatives (order x
    point x joint)."""
    total = sum(span["length"] for span in spans)
    spans = [span for span in spans if span["length"] > SHORTEST * total]
    stations, values, begun = [], [], 0.0
    for number, span in enumerate(spans):
        pieces = max(6, int(np.ceil(STEPS * span["length"] / total)))
        for k in range(0 if number == 0 else 1, pieces + 1):
            stations.append(begun + span["length"] * k / pieces)
            values.append(_derivatives(np.array(span["points"]), span["length"], k / pieces))
        begun += span["length"]
    return np.array(stations), np.array(values).transpose(1, 0, 2)


def _derivatives(points: np.ndarray, length: float, at: float) -> np.ndarray:
    """Returns the value and three derivatives of a polynomial with these Bernstein coefficients."""
    degree, scale, found = points.shape[1] - 1, 1.0, []
    for _ in range(4):
        basis = np.array([comb(degree, i) * at**i * (1 - at) ** (degree - i) for i in range(degree + 1)])
        found.append(scale * points @ basis)
        points, scale, degree = np.diff(points, axis=1), scale * degree / length, degree - 1
    return np.array(found)
