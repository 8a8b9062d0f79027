# SPDX-License-Identifier: Apache-2.0
"""A slice of the sequences of commands to the simulated arm, a different one each day; `make faults` runs all of them."""

from __future__ import annotations

import datetime

import numpy as np

from no_jump import COMMAND_NAMES, SEEDS, exceeded, of_the_day, sequences

A_DAY = 50


def test_nothing_jumps_in_the_sequences_of_the_day() -> None:
    wrong, done = sequences(of_the_day(A_DAY))
    assert not wrong, "\n".join(wrong)
    assert done["move"] and done["velocity"] and done["stop"] and done["halt"], "something was done"
    assert {*done} <= {*COMMAND_NAMES, "refused"}


def test_every_seed_has_its_day() -> None:
    first = datetime.date(2026, 1, 1)
    days = SEEDS // A_DAY
    assert {seed for day in range(days) for seed in of_the_day(A_DAY, first + datetime.timedelta(day))} == {*range(SEEDS)}


def test_a_jump_is_found() -> None:
    times = np.arange(100) * 1e-3
    smooth = 0.5 * 4.0 * times[:, None] ** 2
    steady = np.ones(99, dtype=bool)
    limits = np.array([1.0]), np.array([5.0])
    assert not list(exceeded(times, smooth, steady, *limits))
    for jump, said in ((1e-5, "rad/s²"), (2e-3, "rad/s at")):
        path = smooth + np.where(times > 0.05, jump, 0.0)[:, None]
        assert any(said in wrong for wrong in exceeded(times, path, steady, *limits))
    assert any("no number" in wrong for wrong in exceeded(times, np.where(times > 0.05, np.nan, times)[:, None], steady, *limits))
