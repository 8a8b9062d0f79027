# SPDX-License-Identifier: Apache-2.0
"""Sources, logic, timers, mathematics and statistics against SciPy, NumPy or the text of their standard."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy import signal

from opengpac import library as lib

SPAN = 1e-3
T = np.arange(1500) * SPAN
U = np.random.default_rng(11).normal(size=400) * 3.0 + 1.0
bits = st.lists(st.booleans(), min_size=1, max_size=60)


def test_waveforms_are_scipys() -> None:
    turns = 2 * np.pi * 3.0 * T
    off = np.abs((3.0 * T * 4) % 1.0) > 1e-6  # not at an edge, where the last bit decides
    off &= np.abs((3.0 * T * 4) % 1.0) < 1 - 1e-6

    def wave(shape: int, **more: float) -> np.ndarray:
        return lib.signal_generator.run(len(T), shape=shape, frequency=3.0, amplitude=2.0, offset=0.5, **more).y

    assert_allclose(wave(0), 0.5)
    assert_allclose(wave(1), 0.5 + 2.0 * np.sin(turns), atol=1e-9)
    assert_allclose(wave(2)[off], (0.5 + 2.0 * signal.square(turns))[off])
    assert_allclose(wave(2, duty=0.25)[off], (0.5 + 2.0 * signal.square(turns, duty=0.25))[off])
    assert_allclose(wave(3), 0.5 + 2.0 * signal.sawtooth(turns + np.pi / 2, width=0.5), atol=1e-9)
    assert_allclose(wave(4)[off], (0.5 + 2.0 * signal.sawtooth(turns))[off], atol=1e-9)
    assert lib.signal_generator.run(1, shape=5).fault is not None
    assert lib.signal_generator.run(1, duty=1.5).fault is not None


@pytest.mark.parametrize(("sweep", "method"), [(0, "linear"), (1, "logarithmic")])
def test_chirps_are_scipys(sweep: int, method: str) -> None:
    run = lib.chirp.run(len(T), sweep=sweep, first=2.0, last=40.0, duration=1.0, amplitude=3.0, offset=1.0)
    during = T < 1.0
    expected = 1.0 + 3.0 * signal.chirp(T, f0=2.0, t1=1.0, f1=40.0, method=method, phi=-90)
    assert_allclose(run.y[during], expected[during], atol=1e-6)
    assert_allclose(run.y[~during], 1.0)
    assert_allclose((run.frequency[0], run.frequency[-1]), (2.0, 40.0))
    assert run.conditions[0][:2] == (1000, "finished")
    assert lib.chirp.run(1, sweep=1, first=0.0).fault is not None
    assert lib.chirp.run(1, sweep=2).fault is not None


def test_noise_is_white_and_the_same_each_time() -> None:
    draws = lib.noise.run(20000, mean=2.0, deviation=3.0, seed=5).y
    assert_allclose((draws.mean(), draws.std()), (2.0, 3.0), rtol=0.03)
    centred = draws - draws.mean()
    correlation = [centred[lag:] @ centred[:-lag] / (centred @ centred) for lag in range(1, 20)]
    assert np.abs(correlation).max() < 0.03
    assert np.array_equal(draws, lib.noise.run(20000, mean=2.0, deviation=3.0, seed=5).y)
    assert not np.array_equal(draws, lib.noise.run(20000, mean=2.0, deviation=3.0, seed=6).y)
    even = lib.noise.run(20000, distribution=1).y
    assert np.abs(even).max() <= math.sqrt(3) and abs(even.std() - 1.0) < 0.02
    assert lib.noise.run(1, deviation=-1.0).fault is not None


@pytest.mark.parametrize("delay", [0, 1, 7, 255])
def test_a_delay_line_delays(delay: int) -> None:
    assert_allclose(lib.delay_line.run(u=U, delay=delay, initial=9.0).y, np.r_[np.full(delay, 9.0), U][: len(U)])
    assert lib.delay_line.run(u=U, delay=256).fault is not None


@pytest.mark.parametrize("n", [1, 2, 4])
def test_logic_is_pythons(n: int) -> None:
    rows = [list(row) for row in itertools.product([False, True], repeat=n)]
    assert lib.logic_and.run(u=rows).y.tolist() == [all(row) for row in rows]
    assert lib.logic_or.run(u=rows).y.tolist() == [any(row) for row in rows]
    assert lib.logic_xor.run(u=rows).y.tolist() == [sum(row) % 2 == 1 for row in rows]
    assert lib.logic_not.run(u=[row[0] for row in rows]).y.tolist() == [not row[0] for row in rows]


@settings(max_examples=50, deadline=None)
@given(u=bits)
def test_edges(u: list[bool]) -> None:
    before = [False, *u[:-1]]
    for block, expected in (
        (lib.rising_edge, [x and not b for x, b in zip(u, before, strict=True)]),
        (lib.falling_edge, [b and not x for x, b in zip(u, before, strict=True)]),
    ):
        run = block.run(u=u)
        assert run.y.tolist() == expected
        assert [k for k, _, _ in run.conditions] == [k for k, edge in enumerate(expected) if edge]


@settings(max_examples=50, deadline=None)
@given(pairs=st.lists(st.tuples(st.booleans(), st.booleans()), min_size=1, max_size=40))
def test_flip_flops(pairs: list[tuple[bool, bool]]) -> None:
    sets, resets = [s for s, _ in pairs], [r for _, r in pairs]
    sr, rs, expected_sr, expected_rs = False, False, [], []
    for s, r in pairs:
        sr, rs = s or (not r and sr), not r and (s or rs)
        expected_sr.append(sr)
        expected_rs.append(rs)
    assert lib.flip_flop_sr.run(set=sets, reset=resets).q.tolist() == expected_sr
    assert lib.flip_flop_rs.run(set=sets, reset=resets).q.tolist() == expected_rs


@settings(max_examples=50, deadline=None)
@given(u=st.lists(st.floats(-10, 10), min_size=1, max_size=40), hysteresis=st.floats(0, 3))
def test_a_comparator_does_not_chatter(u: list[float], hysteresis: float) -> None:
    run = lib.comparator.run(u=u, reference=1.0, hysteresis=hysteresis)
    above, expected = False, []
    for x in u:
        above = x - 1.0 > hysteresis if not above else not x - 1.0 < -hysteresis
        expected.append(above)
    assert run.above.tolist() == expected
    turns = [k for k, (now, last) in enumerate(zip(expected, [False, *expected], strict=False)) if now != last]
    assert [(k, name) for k, name, _ in run.conditions] == [(k, "rose" if expected[k] else "fell") for k in turns]
    assert lib.comparator.run(u=0.0, hysteresis=-1.0).fault is not None


def test_selectors() -> None:
    assert lib.selector.run(select=[False, True], a=[1.0, 2.0], b=[3.0, 4.0]).y.tolist() == [1.0, 4.0]
    assert lib.multiplexer.run(u=[[1.0, 2.0, 3.0]] * 3, index=[0, 2, 1]).y.tolist() == [1.0, 3.0, 2.0]
    assert lib.multiplexer.run(u=[[1.0, 2.0, 3.0]], index=[3]).fault is not None


@settings(max_examples=50, deadline=None)
@given(pairs=st.lists(st.tuples(st.booleans(), st.booleans()), min_size=1, max_size=60))
def test_a_counter_counts_edges(pairs: list[tuple[bool, bool]]) -> None:
    up, down = [u for u, _ in pairs], [d for _, d in pairs]
    run = lib.counter.run(up=up, down=down, preset=3)
    edges = [int(now and not last) for now, last in zip(up, [False, *up], strict=False)]
    falls = [int(now and not last) for now, last in zip(down, [False, *down], strict=False)]
    value = np.cumsum(np.array(edges) - np.array(falls))
    assert run.value.tolist() == value.tolist()
    assert run.full.tolist() == (value >= 3).tolist() and run.empty.tolist() == (value <= 0).tolist()


def test_reset_goes_before_load_and_load_before_counting() -> None:
    run = lib.counter.run(up=[True, False, True, False], load=[False, True, True, False], reset=[False, False, True, False], preset=5)
    assert run.value.tolist() == [1, 5, 0, 0]
    assert [k for k, _, _ in run.conditions] == [1]


def timers(u: list[bool], delay_ms: int) -> tuple[list[bool], list[bool], list[bool]]:
    """Returns TON, TOF and TP by the diagrams of IEC 61131-3, at 1 ms."""
    on, off, pulse = [], [], []
    came = went = began = None
    tof, tp, last = False, False, False
    for k, x in enumerate(u):
        came = None if not x else k if came is None else came
        on.append(x and k - (came if came is not None else k) >= delay_ms)
        if x:
            tof, went = True, None
        elif tof:
            went = k if went is None else went
            tof = k - went < delay_ms
        off.append(tof)
        if x and not last and not tp:
            began, tp = k, True
        tp = tp and k - (began or 0) < delay_ms
        pulse.append(tp)
        last = x
    return on, off, pulse


@settings(max_examples=100, deadline=None)
@given(u=bits, delay_ms=st.integers(0, 12))
def test_timers_are_those_of_iec_61131(u: list[bool], delay_ms: int) -> None:
    on, off, pulse = timers(u, delay_ms)
    assert lib.on_delay.run(u=u, delay=delay_ms * SPAN).q.tolist() == on
    assert lib.off_delay.run(u=u, delay=delay_ms * SPAN).q.tolist() == off
    assert lib.pulse.run(u=u, duration=delay_ms * SPAN).q.tolist() == pulse


def test_timers_say_what_has_passed() -> None:
    u = [True] * 6 + [False] * 2
    assert_allclose(lib.on_delay.run(u=u, delay="4 ms").elapsed, np.array([0, 1, 2, 3, 4, 4, 0, 0]) * SPAN)
    assert [k for k, _, _ in lib.on_delay.run(u=u, delay="4 ms").conditions] == [4]
    assert_allclose(lib.pulse.run(u=u, duration="3 ms").elapsed, np.array([0, 1, 2, 3, 3, 3, 0, 0]) * SPAN)
    for name, parameter in (("on_delay", "delay"), ("off_delay", "delay"), ("pulse", "duration")):
        assert lib.block(name).run(u=True, **{parameter: -1.0}).fault is not None


def test_mathematics() -> None:
    u = np.array([-4.0, 0.0, 2.25])
    assert_allclose(lib.absolute.run(u=u).y, np.abs(u))
    assert_allclose(lib.sign.run(u=u).y, np.sign(u))
    assert_allclose(lib.square_root.run(u=u).y, [-2.0, 0.0, 1.5])
    assert_allclose(lib.bias.run(u=u, b=1.5).y, u + 1.5)
    assert_allclose(lib.gain.run(u=u, k=3.0).y, 3.0 * u)
    assert_allclose(lib.scale.run(u=[4.0, 12.0, 20.0], from_low=4.0, from_high=20.0, to_low=0.0, to_high=10.0).y, [0.0, 5.0, 10.0])
    assert lib.scale.run(u=1.0, from_low=2.0, from_high=2.0).fault is not None
    rows = np.random.default_rng(0).normal(size=(20, 5))
    assert_allclose(lib.minimum.run(u=rows).y, rows.min(axis=1))
    assert_allclose(lib.maximum.run(u=rows).y, rows.max(axis=1))
    assert_allclose(lib.product.run(u=rows).y, rows.prod(axis=1))
    assert_allclose(lib.sum.run(u=rows, w=[1.0, -1.0, 2.0, 0.0, 1.0]).y, rows @ [1.0, -1.0, 2.0, 0.0, 1.0])
    assert_allclose(lib.divide.run(u=u, v=[2.0, -1.0, 0.5]).y, u / [2.0, -1.0, 0.5])
    assert lib.divide.run(u=1.0, v=0.0).fault is not None
    assert lib.divide.run(u=1.0, v=-0.1, least=0.1).fault is not None
    assert_allclose(lib.limit.run(u=u, low=-1.0, high=1.0).y, u.clip(-1, 1))


@pytest.mark.parametrize("window", [1, 7, 256])
def test_statistics_of_a_window(window: int) -> None:
    run = lib.statistics.run(u=U, window=window)
    for k in (0, 1, 5, 6, 7, 300, 399):
        part = U[max(0, k - window + 1) : k + 1]
        variance = part.var(ddof=1) if len(part) > 1 else 0.0
        expected = (part.mean(), variance, math.sqrt(np.mean(part**2)), part.min(), part.max())
        assert_allclose((run.mean[k], run.variance[k], run.rms[k], run.least[k], run.greatest[k]), expected, rtol=1e-12)


def test_statistics_since_the_start_or_the_last_reset() -> None:
    reset = np.zeros(len(U), bool)
    reset[100] = True
    run = lib.running_statistics.run(u=U + 1e6, reset=reset)
    for k, part in ((0, U[:1]), (99, U[:100]), (100, U[100:101]), (399, U[100:])):
        part = part + 1e6
        variance = part.var(ddof=1) if len(part) > 1 else 0.0
        assert run.count[k] == len(part)
        assert_allclose((run.mean[k], run.least[k], run.greatest[k]), (part.mean(), part.min(), part.max()), rtol=1e-12)
        assert_allclose(run.variance[k], variance, rtol=1e-8)
        assert_allclose(run.rms[k], math.sqrt(np.mean(part**2)), rtol=1e-12)
