# SPDX-License-Identifier: Apache-2.0
"""Finds the payload of an arm from the joint efforts of a motion.

The efforts are linear in the mass of the payload, in its first moment (mass times centre) and in its inertia about the flange. The
columns of this linear system are the efforts of unit bodies, computed by the block `inverse_dynamics`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import CallError, ValueRefused, refuse
from ..values.quantities import Quantity, duration_ns
from .arm import Arm
from .dynamics import Dynamics, Link, three
from .inertias import matrix_of, six_of
from .kinematics import NONE
from .payload import NO_INERTIA, Payload

SAMPLES_MAX = 500
"""Maximum number of samples that are used; a longer motion is sampled more coarsely after it was smoothed."""
SAMPLES_LEAST = 50
"""Minimum number of samples that remain after smoothing."""
GAP = 10
"""Maximum time between two samples, in median times."""
EFFECT_LEAST = 0.02
"""Minimum effect of each unknown on the joint efforts, N.m (root mean square), for an amount of it that is in `UNITS`."""
UNITS = (1.0, *[0.1] * 3, *[0.01] * 6)
"""Typical amounts of the unknowns: kg, kg m and kg m²."""
INERTIA_EXPECTED = 0.1
"""Prior standard deviation of the inertia of a payload about the flange, kg m²."""
STEADY = 0.02
"""Velocity at which Coulomb friction has three quarters of its full value, rad/s or m/s."""
SLOWER = 4
"""Length of the window in which a motion must show a payload, in windows: noise of the positions shows in it as little acceleration."""
NEGATIVE_MAX = 0.02
"""Largest negative mass that is taken for an error of the model, as a fraction of the mass of the arm."""
HEAVIEST = 3.0
"""Largest mass of a payload, in masses of the arm."""
NAMES = ("mass", *(f"centre along {axis}" for axis in "xyz"), *(f"inertia {axes}" for axes in ("xx", "yy", "zz", "xy", "xz", "yz")))


@dataclass(frozen=True)
class IdentifiedPayload:
    """Payload found by `identify_payload`, and the accuracy with which the motion determines it.

    `mass` (kg) is the number found, which is slightly negative if the arm is lighter than its model; below two standard errors,
    `payload` is `Payload(0)`. `mass_error` (kg) and `centre_error` (m, along x, y and z of the flange) are standard errors.
    `friction` has a row for each joint: its Coulomb friction (N.m) and its viscous friction (N.m s/rad); in N and N s/m for a
    prismatic joint. `residual` is the root mean square of the effort of each joint that nothing explains, N.m or N.
    """

    payload: Payload
    mass: float
    mass_error: float
    centre_error: tuple[float, float, float]
    friction: np.ndarray
    residual: np.ndarray


def identify_payload(
    arm: Arm | Dynamics,
    time: Sequence[float] | np.ndarray,
    positions: Sequence[Sequence[float]] | np.ndarray,
    efforts: Sequence[Sequence[float]] | np.ndarray,
    *,
    inertia: bool = False,
    window: Quantity = "60 ms",
) -> IdentifiedPayload:
    """Finds mass and centre of mass of an arm's payload from the efforts of a recorded motion.

    `time` (s) has a number for each sample, `positions` (rad or m) and `efforts` (N.m or N) have a row for each sample and a column for
    each joint; `efforts` are those of the motors, including the weight of the arm. `inertia=True` also finds the inertia, which
    requires fast rotations of the flange. Positions and efforts are smoothed over `window`, which must be short compared with the
    changes of velocity. Friction of the joints is found as well, but efforts must have no constant error. Any payload that is set as
    `arm.payload` is part of the result.

    Raises `CallError` for samples that do not belong together, and `ValueRefused` if the motion does not determine the payload (the
    message names what it leaves open), or if the mass would be negative or more than three times that of the arm.
    """
    dynamics = arm if isinstance(arm, Dynamics) else arm.dynamics
    window_s = 1e-9 * duration_ns(window, "the window")
    if window_s <= 0:
        refuse(CallError, f"the window must be above 0 s, not {window!r}", 'pass a time such as window="60 ms"')
    samples = _samples(dynamics, time, positions, efforts)
    q, velocity, acceleration, effort, correlated = _smoothed(*samples, window_s)
    slow_q, slow_velocity, slow_acceleration, _, _ = _smoothed(*samples, min(SLOWER * window_s, _longest(samples[0])))
    shown = _columns(dynamics, slow_q, slow_velocity, slow_acceleration)
    _check_determined(shown[:, :, : 10 if inertia else 4], _friction(slow_velocity))
    columns = _columns(dynamics, q, velocity, acceleration)
    rest = effort - dynamics.effort_of_each(q, velocity, acceleration)
    system = np.concatenate([columns, _friction(velocity)], axis=2)
    scaled, found, residual = _solve(system, rest, np.ones(rest.shape[1]))
    for _ in range(2):
        weights = 1.0 / np.maximum(residual, 1e-9 * max(1.0, float(np.abs(effort).max())))
        scaled, found, residual = _solve(system, rest, weights)
    covariance = np.linalg.pinv(scaled.T @ scaled)[:4, :4] * correlated
    return _result(dynamics, found, inertia, covariance, residual)


def _friction(velocity: np.ndarray) -> np.ndarray:
    """Returns the efforts of a unit of each friction (samples x joints x 2 unknowns of each joint)."""
    samples, n = velocity.shape
    friction = np.zeros((samples, n, 2 * n))
    for joint in range(n):
        friction[:, joint, 2 * joint] = np.tanh(velocity[:, joint] / STEADY)
        friction[:, joint, 2 * joint + 1] = velocity[:, joint]
    return friction


def _solve(system: np.ndarray, rest: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns the weighted linear system, its solution by least squares, and the residual of each joint."""
    samples, n, unknowns = system.shape
    # Without this expectation, an inertia that the motion hardly shows would disturb the other unknowns.
    expected = np.zeros((6, unknowns))
    expected[:, 4:10] = np.eye(6) / INERTIA_EXPECTED
    scaled = np.vstack([(system * weights[:, None]).reshape(samples * n, unknowns), expected])
    found, *_ = np.linalg.lstsq(scaled, np.append((rest * weights).reshape(-1), np.zeros(6)), rcond=1e-12)
    return scaled, found, np.sqrt(np.mean((rest - system @ found) ** 2, axis=0))


def _result(dynamics: Dynamics, found: np.ndarray, inertia: bool, covariance: np.ndarray, residual: np.ndarray) -> IdentifiedPayload:
    """Returns the payload of the unknowns, which are in the frame of the arm's base with every joint at 0, about the flange."""
    mass, error, friction = float(found[0]), float(np.sqrt(covariance[0, 0])), found[10:].reshape(-1, 2)
    own = sum(link.mass for link in dynamics.links)
    if mass < -max(3 * error, NEGATIVE_MAX * own) or mass > HEAVIEST * own:
        refuse(
            ValueRefused,
            f"the efforts are those of a payload of {mass:.3g} kg, and the arm of the model has {own:.3g} kg",
            "check that the efforts have the signs of the joints, are in N.m, and include the weight of the arm, and that the model has "
            "the masses of this arm",
        )
    if mass <= 2 * error:
        return IdentifiedPayload(Payload(0.0), mass, error, (0.0, 0.0, 0.0), friction, residual)
    turn, offset = dynamics.kinematics.home.matrix[:3, :3], found[1:4] / mass
    # Derivative of moment/mass by mass and moment, turned into the flange's frame.
    slope = turn.T @ np.column_stack([-offset, np.eye(3)]) / mass
    errors = np.sqrt(np.diag(slope @ covariance @ slope.T))
    about = NO_INERTIA
    if inertia:
        whole = matrix_of(found[4:10]) - mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))
        values, axes = np.linalg.eigh(turn.T @ whole @ turn)
        # The principal moments that a body can have: not negative, and none above the sum of the others.
        small, middle, large = np.maximum(values, 0.0)
        about = six_of((axes * [small, middle, min(large, small + middle)]) @ axes.T)
    return IdentifiedPayload(Payload(mass, three(turn.T @ offset), about), mass, error, three(errors), friction, residual)


def _samples(dynamics: Dynamics, time: Any, positions: Any, efforts: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns times, positions and efforts as arrays; refuses samples that do not belong together."""
    n = len(dynamics.links)
    try:
        t, q, effort = (np.asarray(values, dtype=float) for values in (time, positions, efforts))
    except (TypeError, ValueError):
        refuse(CallError, "the samples are not numbers, or their rows differ in length", f"pass {n} numbers for each sample")
    if t.ndim != 1 or q.shape != (len(t), n) or effort.shape != q.shape:
        refuse(
            CallError,
            f"the samples have the shapes {t.shape}, {q.shape} and {effort.shape}",
            f"pass the time of each sample, and a position and an effort for each of {n} joints",
        )
    if not all(np.isfinite(values).all() for values in (t, q, effort)):
        refuse(CallError, "the samples contain numbers that are not finite", "leave those samples out")
    steps = np.diff(t)
    if not len(steps) or steps.min() <= 0:
        refuse(CallError, "the times of the samples do not increase", "pass the samples in the order in which they were taken")
    step = float(np.median(steps))
    if steps.max() > GAP * step:
        at = int(steps.argmax())
        refuse(CallError, f"the samples have a gap of {steps[at]:.3g} s at {t[at]:.3f} s", "pass one motion without gaps")
    return t, q, effort


def _longest(t: np.ndarray) -> float:
    """Returns the longest window for which enough samples remain."""
    return max(0.0, float(t[-1] - t[0]) - (SAMPLES_LEAST + 2) * float(np.median(np.diff(t))))


def _smoothed(t: np.ndarray, q: np.ndarray, effort: np.ndarray, window_s: float) -> tuple[Any, Any, Any, Any, float]:
    """Returns positions, velocities, accelerations and efforts of at most `SAMPLES_MAX` samples, from a cubic fitted to each window, and
    the number of them over which an error of one sample spreads."""
    step = float(np.median(np.diff(t)))
    half = max(2, round(window_s / step / 2))
    grid = np.arange(t[0], t[-1], step)
    if len(grid) < 2 * half + SAMPLES_LEAST:
        remedy = f"pass {2 * half + SAMPLES_LEAST + 1} or more" + (", or a shorter window=" if half > 2 else "")
        refuse(CallError, f"{len(t)} samples are too few for a window of {window_s:.3g} s", remedy)
    around = np.arange(-half, half + 1) * step
    weights = np.linalg.pinv(np.vander(around, 4, increasing=True))
    every = -(-(len(grid) - 2 * half) // SAMPLES_MAX)
    uniform = np.array([[np.interp(grid, t, column) for column in values.T] for values in (q, effort)])
    windows = np.lib.stride_tricks.sliding_window_view(uniform, 2 * half + 1, axis=2)[:, :, ::every]
    fitted = windows @ weights[:3].T
    spread = max(1.0, 1.0 / float(weights[0] @ weights[0]) / every)
    return fitted[0, :, :, 0].T, fitted[0, :, :, 1].T, 2.0 * fitted[0, :, :, 2].T, fitted[1, :, :, 0].T, spread


def _columns(dynamics: Dynamics, q: Any, velocity: Any, acceleration: Any) -> np.ndarray:
    """Returns the efforts of a unit of each unknown (samples x joints x 10), in the axes of the arm's base with every joint at 0."""
    flange = dynamics.kinematics.home.position
    moving = [i for i, axis in enumerate(dynamics.kinematics.axes) if axis.kind != NONE]
    if not moving:
        refuse(ValueRefused, f"no joint of {dynamics.kinematics.joints} moves the flange", "pass an arm whose joints move its payload")

    def of(body: Link) -> np.ndarray:
        links = [Link()] * len(dynamics.links)
        links[moving[-1]] = body
        return dataclasses.replace(dynamics, links=tuple(links)).effort_of_each(q, velocity, acceleration)

    turning = [of(Link(0.0, three(flange), six_of(np.diag(axis)))) for axis in np.eye(3)]
    pairs = [(0, 1), (0, 2), (1, 2)]
    products = [np.eye(3) + np.eye(3)[[i]].T @ np.eye(3)[[j]] + np.eye(3)[[j]].T @ np.eye(3)[[i]] for i, j in pairs]
    mixed = [of(Link(0.0, three(flange), six_of(product))) - sum(turning) for product in products]
    mass = of(Link(1.0, three(flange)))
    # A point mass 1 m from the flange also has an inertia about the other two axes.
    moments = [of(Link(1.0, three(flange + axis))) - mass - sum(turning) + turning[i] for i, axis in enumerate(np.eye(3))]
    return np.stack([mass, *moments, *turning, *mixed], axis=2)


def _check_determined(columns: np.ndarray, friction: np.ndarray) -> None:
    """Refuses a motion whose efforts would be almost the same for another payload and another friction."""
    samples, n, unknowns = columns.shape
    scaled = (columns * UNITS[:unknowns]).reshape(samples * n, unknowns)
    base, weights, _ = np.linalg.svd(friction.reshape(samples * n, -1), full_matrices=False)
    base = base[:, weights > 1e-9 * max(weights.max(), 1e-30)]
    own = scaled - base @ (base.T @ scaled)
    _, effects, directions = np.linalg.svd(own / np.sqrt(samples), full_matrices=False)
    if effects[-1] < EFFECT_LEAST:
        named = [NAMES[i] for i in np.flatnonzero(np.abs(directions[-1]) > 0.3)]
        refuse(
            ValueRefused,
            f"the motion does not determine the payload: its efforts depend too little ({effects[-1]:.2g} N.m) on {', '.join(named)}",
            "let the motion turn the flange about two axes" + (", and accelerate its rotations" if unknowns > 4 else ""),
        )
