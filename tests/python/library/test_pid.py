# SPDX-License-Identifier: Apache-2.0
"""The PID controller: each term, both kinds of anti-windup, weights, the derivative's lag, bumpless transfer."""

from __future__ import annotations

import numpy as np
from numpy.testing import assert_allclose

from opengpac import library as lib

SPAN = 1e-3


def controlled(steps: int, load: float = 0.0, **parameters: float) -> np.ndarray:
    """Returns measured values of a first-order plant, x' = (effort + load - x) / 0.05, under the documented recursion of the block."""
    kp, ki, limit = parameters["kp"], parameters["ki"], parameters["limit"]
    x, integral, xs = 0.0, 0.0, []
    for k in range(steps):
        error = 1.0 - x
        more = integral + ki * error * (SPAN if k else 0.0)
        wanted = kp * error + more
        effort = float(np.clip(wanted, -limit, limit))
        if parameters.get("anti_windup"):
            integral = more - (wanted - effort) * min(SPAN / parameters["tracking_time"], 1.0) if k else more
        elif effort == wanted or (wanted - effort) * error * ki <= 0:
            integral = more
        xs.append(x)
        x += (effort + load - x) / 0.05 * SPAN
    return np.array(xs)


def efforts(measured: np.ndarray, **parameters: float) -> np.ndarray:
    return lib.pid.run(setpoint=1.0, measured=measured, **parameters).effort


def test_the_terms() -> None:
    t = np.arange(200) * SPAN
    run = lib.pid.run(setpoint=1.0, measured=0.5 * t, kp=2.0, ki=3.0, kd=0.1, feedforward=7.0)
    error = 1.0 - 0.5 * t
    integral = 3.0 * SPAN * np.cumsum(error)
    expected = 2.0 * error + (integral - integral[0]) - 0.05 + 7.0
    assert_allclose(run.effort[1:], expected[1:], rtol=1e-9)
    assert_allclose(run.error, error)


def test_both_kinds_of_anti_windup_follow_their_equations() -> None:
    for more in ({}, {"anti_windup": 1, "tracking_time": 0.01}):
        parameters = {"kp": 4.0, "ki": 60.0, "limit": 1.2, **more}
        measured = controlled(400, **parameters)
        run = lib.pid.run(setpoint=1.0, measured=measured, **parameters)
        effort = np.diff(measured) / SPAN * 0.05 + measured[:-1]
        assert_allclose(run.effort[:-1], effort, atol=1e-9)


def test_anti_windup_takes_the_overshoot_away() -> None:
    """With a limit just above the required effort, an integral that winds up overshoots; with these two methods it does not."""
    wound = controlled(3000, kp=1.0, ki=100.0, limit=1e9)
    held = controlled(3000, kp=1.0, ki=100.0, limit=1.1)
    drawn = controlled(3000, kp=1.0, ki=100.0, limit=1.1, anti_windup=1, tracking_time=0.01)
    assert wound.max() > 1.2
    assert held.max() < 1.1 and drawn.max() < 1.1
    assert_allclose((held[-1], drawn[-1]), 1.0, atol=1e-3)


def test_at_the_limit_back_calculation_settles_where_the_excess_balances_the_error() -> None:
    effort = lib.pid.run(setpoint=5.0, measured=np.zeros(5000), kp=1.0, ki=10.0, limit=2.0, anti_windup=1, tracking_time=0.1)
    assert effort.effort[-1] == 2.0
    # The excess settles at ki e Tt = 5, so kp e + integral = 7; when the set-point is reversed, the effort leaves its limit at once.
    setpoint = np.r_[np.full(5000, 5.0), -1.0]
    turned = lib.pid.run(setpoint=setpoint, measured=0.0, kp=1.0, ki=10.0, limit=2.0, anti_windup=1, tracking_time=0.1)
    assert_allclose(turned.effort[-1], -1.0 + (2.0 - 5.0 * 0.01) - 10.0 * SPAN, rtol=1e-6)


def test_set_point_weights() -> None:
    setpoint = np.r_[0.0, np.ones(5)]
    effort = lib.pid.run(setpoint=setpoint, measured=0.25, kp=2.0, setpoint_weight=0.4).effort
    assert_allclose(effort, 2.0 * (0.4 * setpoint - 0.25))
    kick = lib.pid.run(setpoint=setpoint, measured=0.0, kp=0.0, kd=0.01).effort
    assert_allclose(kick, 0.0)
    kick = lib.pid.run(setpoint=setpoint, measured=0.0, kp=0.0, kd=0.01, derivative_weight=0.5).effort
    assert_allclose(kick, [0.0, 0.01 * 0.5 / SPAN, 0.0, 0.0, 0.0, 0.0])


def test_the_derivative_lags() -> None:
    noise = np.random.default_rng(5).normal(size=300)
    effort = efforts(noise, kp=0.0, kd=0.2, derivative_time=0.01)
    assert_allclose(effort, -0.2 * lib.differentiator.run(u=noise, time=0.01).y, rtol=1e-9, atol=1e-9)


def test_manual_and_back_without_a_bump() -> None:
    manual = np.r_[np.ones(10, bool), np.zeros(10, bool)]
    run = lib.pid.run(setpoint=1.0, measured=0.4, manual=manual, manual_effort=3.0, kp=2.0, ki=5.0)
    assert_allclose(run.effort[:10], 3.0)
    assert_allclose(run.effort[10:], 3.0 + 5.0 * 0.6 * SPAN * np.arange(1, 11), rtol=1e-12)


def test_a_heater_never_cools() -> None:
    effort = lib.pid.run(setpoint=0.0, measured=np.linspace(-1, 1, 50), kp=100.0, limit=40.0, least=0.0).effort
    assert effort.min() == 0.0 and effort.max() == 40.0


def test_what_is_wrong_is_a_fault() -> None:
    faults = [
        ({"limit": -1.0}, 1),
        ({"limit": 1.0, "least": 2.0}, 1),
        ({"anti_windup": 2}, 2),
        ({"derivative_time": -0.1}, 3),
        ({"tracking_time": 0.0}, 3),
    ]
    for wrong, code in faults:
        assert f"fault {code}" in lib.pid.run(setpoint=0.0, measured=0.0, **wrong).fault["text"]
