# SPDX-License-Identifier: Apache-2.0
"""The filters of the library against SciPy, or against a closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import signal

from opengpac import library as lib

SPAN = 1e-3
rng = np.random.default_rng(7)
U = rng.normal(size=400) + 2.0


def test_a_biquad_is_lfilter() -> None:
    b, a = signal.butter(2, 0.2)
    y = lib.biquad.run(u=U, b0=b[0], b1=b[1], b2=b[2], a1=a[1], a2=a[2]).y
    assert_allclose(y, signal.lfilter(b, a, U), rtol=1e-12, atol=1e-12)


def test_a_biquad_that_is_not_stable_is_a_fault() -> None:
    assert "not stable" in lib.show("biquad")
    assert lib.biquad.run(u=1.0, a2=1.0).fault["invocation"] == 0
    assert lib.biquad.run(u=1.0, a1=1.5, a2=0.4).fault is not None


@pytest.mark.parametrize("order", [2, 6, 16])
def test_a_cascade_is_sosfilt(order: int) -> None:
    sections = signal.cheby1(order, 1.0, 0.3, output="sos")
    y = lib.biquad_cascade.run(u=U, sections=sections).y
    assert_allclose(y, signal.sosfilt(sections, U), rtol=1e-10, atol=1e-10)


def test_a_cascade_wants_normalised_stable_rows() -> None:
    assert "fault 2" in lib.biquad_cascade.run(u=1.0, sections=[[1, 0, 0, 2, 0, 0]]).fault["text"]
    assert "fault 1" in lib.biquad_cascade.run(u=1.0, sections=[[1, 0, 0, 1, 0, -1.5]]).fault["text"]


def test_a_transfer_function_is_lfilter() -> None:
    b, a = [0.5, -0.2, 0.1, 0.05], [2.0, -0.8, 0.3, -0.1]
    assert_allclose(lib.transfer_function.run(u=U, b=b, a=a).y, signal.lfilter(b, a, U), rtol=1e-12)
    taps = signal.firwin(16, 0.4)
    assert_allclose(lib.transfer_function.run(u=U, b=taps, a=[1.0] + [0.0] * 15).y, signal.lfilter(taps, [1.0], U), rtol=1e-12)
    assert lib.transfer_function.run(u=1.0, b=[3.0], a=[2.0]).y[0] == 1.5
    assert lib.transfer_function.run(u=1.0, b=[1.0, 0.0], a=[0.0, 1.0]).fault is not None


@pytest.mark.parametrize(("kind", "numerator"), [(0, [0, 0, 1]), (1, [1, 0, 0]), (2, [0, 1, 0]), (3, [1, 0, 1])])
@pytest.mark.parametrize(("frequency", "quality"), [(10.0, 1 / math.sqrt(2)), (150.0, 4.0)])
def test_a_second_order_filter_is_the_bilinear_transform(kind: int, numerator: list[float], frequency: float, quality: float) -> None:
    # Prewarped so that the frequency is exact: the analog frequency is 2 / T tan(w T / 2).
    w = 2 / SPAN * math.tan(math.pi * frequency * SPAN)
    analog = [n * w ** (k if kind != 2 else 1) for k, n in enumerate(numerator)]
    if kind == 2:
        analog = [0, w / quality, 0]
    b, a = signal.bilinear(analog, [1, w / quality, w * w], fs=1 / SPAN)
    at_rest = signal.lfilter_zi(b, a) * U[0]
    expected, _ = signal.lfilter(b, a, U, zi=at_rest)
    assert_allclose(lib.second_order.run(u=U, kind=kind, frequency=frequency, quality=quality).y, expected, rtol=1e-7, atol=1e-9)


def test_a_notch_takes_out_its_frequency_and_nothing_of_a_constant() -> None:
    t = np.arange(4000) * SPAN
    y = lib.second_order.run(u=5.0 + np.sin(2 * np.pi * 50 * t), kind=3, frequency=50.0, quality=2.0).y
    assert_allclose(y[2000:], 5.0, atol=1e-9)


def test_a_second_order_filter_says_what_is_wrong() -> None:
    for wrong, code in (({"kind": 4}, 1), ({"quality": 0.0}, 2), ({"frequency": -1.0}, 2), ({"frequency": 500.0}, 3)):
        assert f"fault {code}" in lib.second_order.run(u=[1.0, 1.0, 1.0], **wrong).fault["text"]


def test_a_second_order_filter_follows_its_interval() -> None:
    b, a = signal.butter(2, 2.0, fs=50.0)
    expected, _ = signal.lfilter(b, a, U, zi=signal.lfilter_zi(b, a) * U[0])
    assert_allclose(lib.second_order.run(u=U, frequency=2.0, every="20 ms").y, expected, rtol=1e-7)


def test_a_first_order_lag_is_zero_order_hold() -> None:
    (b,), a, _ = signal.cont2discrete(([2.5], [0.02, 1.0]), SPAN, method="zoh")
    expected, _ = signal.lfilter(b, a, U, zi=[2.5 * U[0] - b[0] * U[0]])
    assert_allclose(lib.first_order_lag.run(u=U, k=2.5, time=0.02).y, expected, rtol=1e-10)
    assert_allclose(lib.first_order_lag.run(u=U, k=2.5, time=0.0).y, 2.5 * U)
    assert lib.first_order_lag.run(u=1.0, time=-1.0).fault is not None


def test_lead_lag_and_washout_are_bilinear() -> None:
    (b,), a, _ = signal.cont2discrete(([2.0 * 0.05, 2.0], [0.01, 1.0]), SPAN, method="bilinear")
    expected, _ = signal.lfilter(b, a, U, zi=signal.lfilter_zi(b, a) * U[0])
    assert_allclose(lib.lead_lag.run(u=U, k=2.0, lead=0.05, lag=0.01).y, expected, rtol=1e-9)
    (b,), a, _ = signal.cont2discrete(([0.05, 0.0], [0.05, 1.0]), SPAN, method="bilinear")
    expected, _ = signal.lfilter(b, a, U, zi=signal.lfilter_zi(b, a) * U[0])
    assert_allclose(lib.washout.run(u=U, time=0.05).y, expected, rtol=1e-9, atol=1e-12)
    assert lib.lead_lag.run(u=1.0, lag=0.0).fault is not None
    assert lib.washout.run(u=1.0, time=0.0).fault is not None


def test_lowpass_is_lfilter() -> None:
    assert_allclose(lib.lowpass.run(u=U, alpha=0.3).y, signal.lfilter([0.3], [1.0, -0.7], U), rtol=1e-12)


@pytest.mark.parametrize("window", [1, 4, 256])
def test_a_moving_average_is_the_mean_of_its_window(window: int) -> None:
    expected = [U[max(0, k - window + 1) : k + 1].mean() for k in range(len(U))]
    assert_allclose(lib.moving_average.run(u=U, window=window).y, expected, rtol=1e-12)


@pytest.mark.parametrize("window", [1, 2, 5, 31])
def test_a_median_is_the_median_of_its_window(window: int) -> None:
    y = lib.median.run(u=U, window=window).y
    assert_allclose(y, [np.median(U[max(0, k - window + 1) : k + 1]) for k in range(len(U))])
    if window % 2:
        half = window // 2
        assert_allclose(y[window - 1 :], signal.medfilt(U, window)[half : len(U) - half])


def test_windows_out_of_range_are_faults() -> None:
    for block, most in ((lib.moving_average, 256), (lib.median, 31), (lib.statistics, 256)):
        assert block.run(u=1.0, window=most).fault is None
        assert block.run(u=1.0, window=most + 1).fault is not None
        assert block.run(u=1.0, window=0).fault is not None


def test_an_alpha_beta_observer_tracks_a_ramp_without_error() -> None:
    t = np.arange(2000) * SPAN
    run = lib.alpha_beta.run(u=3.0 * t + 1.0)
    assert_allclose(run.position[-1], 3.0 * t[-1] + 1.0, atol=1e-9)
    assert_allclose((run.velocity[-1], run.residual[-1]), (3.0, 0.0), atol=1e-8)


def test_an_alpha_beta_observer_is_its_recursion() -> None:
    run = lib.alpha_beta.run(u=U, alpha=0.4, beta=0.1)
    x, v, xs = U[0], 0.0, [U[0]]
    for u in U[1:]:
        ahead = x + v * SPAN
        x, v = ahead + 0.4 * (u - ahead), v + 0.1 * (u - ahead) / SPAN
        xs.append(x)
    assert_allclose(run.position, xs, rtol=1e-9)
    assert lib.alpha_beta.run(u=1.0, alpha=0.5, beta=3.1).fault is not None


def test_a_kalman_filter_settles_where_the_riccati_equation_does() -> None:
    run = lib.kalman.run(u=U, noise=0.5, drift=20.0)
    q, r = 20.0 * SPAN, 0.5
    ahead = 0.5 * (q + math.sqrt(q * q + 4 * q * r))
    assert_allclose(run.gain[-1], ahead / (ahead + r), rtol=1e-9)
    assert_allclose(run.variance[-1], ahead - q, rtol=1e-9)
    assert_allclose(lib.kalman.run(u=U, noise=1.0, drift=0.0).y, np.cumsum(U) / np.arange(1, len(U) + 1), rtol=1e-9)
    assert lib.kalman.run(u=1.0, noise=0.0).fault is not None
