# SPDX-License-Identifier: Apache-2.0
"""Control blocks against SciPy or a closed form, and their guarantees for every input, by Hypothesis."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy import integrate, interpolate, signal

from opengpac import library as lib

SPAN = 1e-3
U = np.random.default_rng(3).normal(size=300) + 1.0
signals = st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=40)


@settings(max_examples=60, deadline=None)
@given(u=signals, rising=st.floats(0, 1e4), falling=st.floats(0, 1e4))
@example(u=[1.0, 0.0, 1.0], rising=1.0, falling=1.0)
def test_a_rate_limiter_never_exceeds_its_rates(u: list[float], rising: float, falling: float) -> None:
    run = lib.rate_limiter.run(u=u, rising=rising, falling=falling)
    steps = np.diff(run.y)
    room = 1e-9 * np.maximum(1.0, np.abs(run.y[1:]))
    assert run.y[0] == u[0]
    assert np.all(steps <= rising * SPAN + room) and np.all(steps >= -falling * SPAN - room)
    limited = {k for k, name, _ in run.conditions if name == "limited"}
    assert all((y == x) != (k in limited) for k, (x, y) in enumerate(zip(u, run.y, strict=True)))


def test_a_step_through_a_rate_limiter_is_a_ramp() -> None:
    y = lib.rate_limiter.run(u=[0.0] + [1.0] * 20, rising=100.0).y
    assert_allclose(y, np.minimum(0.1 * np.arange(21), 1.0), atol=1e-12)
    assert lib.rate_limiter.run(u=1.0, falling=-1.0).fault is not None


@settings(max_examples=60, deadline=None)
@given(u=signals, width=st.floats(0, 1e3), middle=st.floats(-1e3, 1e3))
def test_a_dead_band_is_soft_thresholding(u: list[float], width: float, middle: float) -> None:
    off = np.array(u) - middle
    y = lib.dead_band.run(u=u, width=width, middle=middle).y
    assert_allclose(y, np.sign(off) * np.maximum(np.abs(off) - width, 0.0), rtol=1e-12, atol=0)
    assert np.all(y[np.abs(off) <= width] == 0)


@settings(max_examples=60, deadline=None)
@given(u=signals, levels=st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3)))
def test_a_relay_changes_only_beyond_its_levels(u: list[float], levels: tuple[float, float]) -> None:
    lower, upper = sorted(levels)
    run = lib.hysteresis.run(u=u, lower=lower, upper=upper, high=5.0, low=-5.0)
    active = False
    for x, is_active, y in zip(u, run.active, run.y, strict=True):
        active = True if x >= upper else False if x <= lower else active
        assert (is_active, y) == (active, 5.0 if active else -5.0)


def test_a_relay_says_what_is_wrong() -> None:
    assert "fault 1" in lib.hysteresis.run(u=0.0, lower=1.0, upper=0.0).fault["text"]


def test_an_integrator_is_the_trapezoidal_rule() -> None:
    expected = 3.0 + 2.0 * integrate.cumulative_trapezoid(U, dx=SPAN, initial=0)
    assert_allclose(lib.integrator.run(u=U, gain=2.0, initial=3.0).y, expected, rtol=1e-12)


def test_an_integrator_keeps_its_limits_leaves_them_at_once_and_resets() -> None:
    u = np.array([1.0] * 50 + [-1.0] * 20)
    y = lib.integrator.run(u=u, high=0.02, low=-1.0).y
    assert y.max() == 0.02 and y[51] < 0.02
    y = lib.integrator.run(u=[1.0] * 6, reset=[False, False, False, True, False, False], initial=[7.0] * 6).y
    assert_allclose(y, [7.0, 7.001, 7.002, 7.0, 7.001, 7.002])
    assert lib.integrator.run(u=1.0, low=1.0, high=0.0).fault is not None


@pytest.mark.parametrize("time", [0.0, 0.02])
def test_a_differentiator_is_by_backward_differences(time: float) -> None:
    b, a = [1 / (time + SPAN), -1 / (time + SPAN)], [1.0, -time / (time + SPAN)]
    if time:
        (expected_b,), expected_a, _ = signal.cont2discrete(([1.0, 0.0], [time, 1.0]), SPAN, method="backward_diff")
        assert_allclose((*b, *a), (*expected_b, *expected_a), rtol=1e-9)
    expected, _ = signal.lfilter(b, a, U, zi=[-b[0] * U[0]])
    assert_allclose(lib.differentiator.run(u=U, time=time).y, expected, rtol=1e-9, atol=1e-9)
    assert_allclose(lib.differentiator.run(u=4.0 * SPAN * np.arange(1000), time=time).y[-1], 4.0, rtol=1e-9)


def test_state_space_is_dlsim() -> None:
    a, b, c, d = (
        np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-5.0, -6.0, -4.0]]),
        np.array([[0.0], [0.0], [1.0]]),
        np.array([[5.0, 1.0, 0.0]]),
        np.array([[0.5]]),
    )
    ad, bd, cd, dd, _ = signal.cont2discrete((a, b, c, d), 0.05)
    _, y, x = signal.dlsim((ad, bd, cd, dd, 0.05), U, x0=[1.0, 0.0, -1.0])
    run = lib.state_space.run(u=U, a=lib.padded(ad), b=bd.ravel(), c=cd.ravel(), d=dd.item(), initial=[1.0, 0.0, -1.0])
    assert_allclose(run.y, y.ravel(), rtol=1e-9, atol=1e-12)
    assert_allclose(run.x, x, rtol=1e-9, atol=1e-12)


def test_state_space_makes_an_observer() -> None:
    """x^' = (A - L C) x^ + B u + L y finds the state of the plant from its output."""
    a, b, c = np.array([[1.0, 0.1], [0.0, 1.0]]), np.array([0.005, 0.1]), np.array([1.0, 0.0])
    gain = np.array([0.8, 1.2])
    plant = lib.state_space.run(u=U, a=lib.padded(a), b=b, c=c, initial=[2.0, -1.0])
    observer = lib.state_space.run(u=U, w=plant.y, a=lib.padded(a - np.outer(gain, c)), b=b, c=c, e=gain)
    assert_allclose(observer.x[-1], plant.x[-1], atol=1e-9)


def test_state_feedback() -> None:
    run = lib.state_feedback.run(x=[[1.0, 2.0], [100.0, 0.0]], k=[3.0, -0.5], reference=4.0, reference_gain=2.0, limit=20.0)
    assert run.effort.tolist() == [8.0 - 3.0 + 1.0, -20.0]


@settings(max_examples=60, deadline=None)
@given(u=signals, step=st.floats(1e-3, 1e3))
def test_a_quantizer_is_off_by_half_a_step_at_most(u: list[float], step: float) -> None:
    y = lib.quantizer.run(u=u, step=step).y
    assert np.all(np.abs(y - u) <= 0.5 * step * (1 + 1e-9) + 1e-9)
    assert_allclose(y / step, np.round(y / step), atol=1e-6)


XS, YS = [-2.0, 0.0, 0.5, 3.0], [1.0, 4.0, -1.0, 2.0]


@settings(max_examples=60, deadline=None)
@given(u=st.lists(st.floats(-5, 5), min_size=1, max_size=30))
def test_a_lookup_table_is_numpys_interp(u: list[float]) -> None:
    run = lib.lookup_table.run(u=u, xs=XS, ys=YS)
    assert_allclose(run.y, np.interp(u, XS, YS), rtol=1e-12, atol=1e-12)
    assert [k for k, _, _ in run.conditions] == [k for k, x in enumerate(u) if not XS[0] <= x <= XS[-1]]


def test_the_ends_of_a_lookup_table() -> None:
    u = [-4.0, 5.0]
    line = interpolate.interp1d(XS, YS, fill_value="extrapolate")
    assert_allclose(lib.lookup_table.run(u=u, xs=XS, ys=YS, ends=1).y, line(u))
    assert "fault 3" in lib.lookup_table.run(u=u, xs=XS, ys=YS, ends=2).fault["text"]
    assert "fault 2" in lib.lookup_table.run(u=u, xs=XS, ys=YS, ends=3).fault["text"]
    assert "fault 1" in lib.lookup_table.run(u=u, xs=[0.0, 0.0, 1.0, 2.0], ys=YS).fault["text"]
    assert lib.lookup_table.run(u=[0.25], xs=[0.0, 1.0], ys=[3.0, 5.0]).y[0] == 3.5


def test_a_lookup_surface_is_bilinear() -> None:
    xs, ys = np.array([0.0, 1.0, 4.0]), np.array([-1.0, 0.0, 2.0, 3.0])
    zs = np.random.default_rng(1).normal(size=(3, 4))
    x, y = np.random.default_rng(2).uniform(-2, 5, size=(2, 200))
    exact = interpolate.RegularGridInterpolator((xs, ys), zs)
    z = lib.lookup_surface.run(x=x, y=y, xs=xs, columns=4, ys=lib.padded(ys), zs=lib.padded(zs)).z
    assert_allclose(z, exact(np.column_stack([x.clip(0, 4), y.clip(-1, 3)])), rtol=1e-9, atol=1e-12)
    assert lib.lookup_surface.run(x=0.0, y=0.0, columns=9).fault is not None
    assert lib.lookup_surface.run(x=0.0, y=0.0, columns=3, ys=lib.padded([0.0, 1.0, 1.0])).fault is not None
