# SPDX-License-Identifier: Apache-2.0
"""The examples' own blocks in C, each tried without a system."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import opengpac as gpac
from programs import BLOCKS

MS = 1e-3


Code = dict[str, gpac.Module]


@pytest.fixture(scope="module")
def code() -> Iterator[Code]:
    """Yields the modules by their file names."""
    with gpac.System("blocks", clock="virtual") as cell:
        yield {name: cell.download(BLOCKS / f"{name}.c") for name in ("admittance", "glide", "grasp", "noise")}


@pytest.mark.parametrize("distance", [0.05, -0.05, 0.0004, 0.0])
def test_a_glide_arrives_within_its_limits(code: Code, distance: float) -> None:
    run = code["glide"].glide.run(steps=3000, distance=distance, speed=0.1, acceleration=0.5)
    assert run.along[-1] == distance
    assert np.abs(run.rate).max() <= 0.1 + 1e-9
    assert np.abs(np.diff(run.rate)).max() <= 0.5 * MS * 1.01 + 1e-9
    assert np.abs(run.along).max() <= abs(distance) + 1e-6, "it does not overshoot"
    assert any(name == "there" for _, name, _ in run.conditions)


@pytest.mark.parametrize("rate", [0.2, -0.2])
def test_a_brake_stops_in_the_square_of_the_speed_over_twice_the_deceleration(code: Code, rate: float) -> None:
    run = code["glide"].brake.run(was_along=[1.0] * 300, was_rate=rate, deceleration=1.0)
    assert abs(run.along[-1] - 1.0 - np.sign(rate) * 0.02) < 0.2 * MS
    first = next(number for number, name, _ in run.conditions if name == "stopped")
    assert abs(first - 200) <= 1, "0.2 m/s at 1 m/s^2"


def test_an_admittance_is_a_mass_on_a_spring(code: Code) -> None:
    force: list[Any] = [[1.0, 0.0, 7.0]] + [[21.0, 0.0, 7.0]] * 4000
    run = code["admittance"].admittance.run(force=force, stiffness=400.0, damping=80.0, mass=4.0)
    # Critically damped: x = F/k (1 - (1 + w t) exp(-w t)), with w = sqrt(k / m) = 10/s and F beyond the force at the start.
    times = np.arange(len(force) - 1) * MS
    expected = 20.0 / 400.0 * (1.0 - (1.0 + 10.0 * times) * np.exp(-10.0 * times))
    assert np.abs(run.along[1:] - expected).max() < 0.3e-3
    assert code["admittance"].admittance.run(force=[[0.0, 0.0, 0.0]], mass=0.0).fault is not None


def test_yielding_gives_way_to_the_finger_that_feels_more(code: Code) -> None:
    yielding = code["grasp"].yielding
    left = yielding.run(force=[[1.0, 0.5]] * 101, gain=0.1)
    assert abs(left.along[-1] + 0.1 * 0.5 * 0.1) < 1e-9, "to -x, from the finger at -x"
    assert abs(yielding.run(force=[[0.0, 99.0]] * 101, speed_max=0.05).along[-1] - 0.05 * 0.1) < 1e-9
    assert not np.any(yielding.run(force=[[3.0, 3.0]] * 10).along)


def test_touch_tells_one_from_both(code: Code) -> None:
    touch = code["grasp"].touch
    one = touch.run(force=[[0.0, 0.0], [0.2, 0.0]], position=[[0.02, 0.03]] * 2)
    assert [(number, name) for number, name, _ in one.conditions] == [(1, "one")] and np.allclose(one.width, 0.05)
    both = touch.run(force=[[0.5, 0.52]] * 25, position=[[0.0, 0.0]] * 25, patience=20)
    assert [number for number, name, _ in both.conditions if name == "both"] == [19, 20, 21, 22, 23, 24]
    uneven = touch.run(force=[[0.5, 0.9]] * 25, position=[[0.0, 0.0]] * 25)
    assert all(name == "one" for _, name, _ in uneven.conditions)


def test_fingers_move_together_and_stop_at_their_limits(code: Code) -> None:
    fingers = code["grasp"].fingers
    run = fingers.run(start=[[0.03, 0.01]] * 2001, speed=-0.02)
    assert np.allclose(run.setpoint[500], [0.02, 0.0], atol=1e-9) and np.allclose(run.setpoint[-1], 0.0)
    assert any(name == "at_limit" for _, name, _ in run.conditions)
    assert not np.diff(run.setpoint, axis=0).max() > 0.0
    opened = fingers.run(start=[[-0.06, 0.01]] * 2001, speed=0.1, most=0.048)
    assert np.allclose(opened.setpoint[-1], 0.048) and np.allclose(opened.setpoint[0], [-0.06, 0.01]), "from where they are"


def test_a_noisy_encoder_is_even_and_the_same_each_time(code: Code) -> None:
    encoder = code["noise"].noisy_encoder
    noise = encoder.run(steps=20_000, amplitude=0.5).y
    assert np.array_equal(noise, encoder.run(steps=20_000, amplitude=0.5).y)
    assert np.abs(noise).max() < 0.5 and abs(noise.mean()) < 0.01 and abs(noise.std() - 0.5 / np.sqrt(3.0)) < 0.01
