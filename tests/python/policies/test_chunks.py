# SPDX-License-Identifier: Apache-2.0
"""`action_chunk` plays chunks without a step of position or velocity, for any inference time, and agrees with SciPy's spline."""

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from opengpac import library

INTERVAL, N, HORIZON_S, MS = 0.02, 16, 2.0, 1_000_000


def motion(t: np.ndarray) -> np.ndarray:
    return 0.4 * np.sin(2 * np.pi * 0.5 * t) + 0.1 * np.sin(2 * np.pi * 1.3 * t)


def inferred(delay_ms: int, error: float, steps: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns the outputs of a policy that observes the world, needs `delay_ms`, outputs a chunk and repeats; chunks differ by up to
    `error`."""
    rng = np.random.default_rng(3)
    actions, number, observed = np.zeros((steps, N)), np.zeros(steps, dtype=int), np.zeros(steps, dtype=int)
    for i, seen in enumerate(range(0, steps, delay_ms)):
        given = slice(seen + delay_ms, steps)
        actions[given] = motion(seen * 1e-3 + INTERVAL * np.arange(N)) + rng.uniform(-error, error)
        number[given], observed[given] = i + 1, seen * MS
    return actions, number, observed


@pytest.mark.parametrize("delay_ms", [5, 20, 50, 100, 200])
def test_position_and_velocity_are_continuous_whatever_the_inference_takes(delay_ms: int) -> None:
    steps, error, blend = int(HORIZON_S * 1000), 0.01, 0.1
    actions, number, observed = inferred(delay_ms, error, steps)
    trial = library.action_chunk.run(n=N, interval=INTERVAL, blend=blend, present=0.0, actions=actions, number=number, observed=observed)
    assert trial.fault is None
    y, velocity = trial.y, trial.velocity
    # Maximum acceleration: of the motion's spline, of a stop at a chunk's end, and of a correction.
    fastest = 0.4 * np.pi + 0.26 * np.pi
    bound = (
        0.4 * np.pi**2
        + 0.1 * (2.6 * np.pi) ** 2
        + 6 * fastest / INTERVAL * (delay_ms * 1e-3 > INTERVAL * (N - 1) / 2)
        + 60 * error / blend**2
        + 20 * fastest / blend
    )
    assert np.abs(np.diff(velocity)).max() < bound * 1e-3
    # Velocity is the derivative of position.
    assert np.abs(np.diff(y) / 1e-3 - 0.5 * (velocity[1:] + velocity[:-1])).max() < bound * 1e-3
    settled = np.arange(steps) > 1000
    if delay_ms < 1000 * INTERVAL * (N - 2) / 2:
        assert np.abs(y - motion(np.arange(steps) * 1e-3))[settled].max() < 3 * error


def test_one_chunk_is_the_spline_of_scipy_and_ends_at_rest() -> None:
    rng = np.random.default_rng(5)
    actions = rng.standard_normal(6)
    times = INTERVAL * np.arange(6)
    slopes = np.concatenate([[actions[1] - actions[0]], 0.5 * (actions[2:] - actions[:-2]), [0.0]]) / INTERVAL
    spline = CubicHermiteSpline(times, actions, slopes)
    trial = library.action_chunk.run(
        150, n=6, interval=INTERVAL, blend=1e-6, present=actions[0], actions=actions, number=[0] + [1] * 149, observed=0
    )
    t = np.arange(2, 100) * 1e-3
    np.testing.assert_allclose(trial.y[2:100], spline(t), atol=1e-9)
    np.testing.assert_allclose(trial.velocity[2:100], spline(t, 1), atol=1e-7)
    np.testing.assert_allclose(trial.y[100:], actions[-1], atol=1e-12)
    np.testing.assert_allclose(trial.velocity[101:], 0.0, atol=1e-12)


def test_a_chunk_from_the_future_is_a_fault_and_one_that_ended_is_stale() -> None:
    trial = library.action_chunk.run(3, n=2, actions=[0.0, 1.0], number=1, observed=5 * MS)
    assert trial.fault["text"] == "the block returned fault 2"
    ended = library.action_chunk.run(200, n=2, actions=[0.0, 1.0], number=1, observed=0)
    assert ended.conditions[0][:2] == (121, "stale")
