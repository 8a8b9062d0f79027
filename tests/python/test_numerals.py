# SPDX-License-Identifier: Apache-2.0
"""Numbers of other libraries are accepted wherever a number is: calls, durations, values, ranges, poses, driver options."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import opengpac as gpac
from opengpac.values import encoding
from opengpac.values.numbers import number
from rig import Rig


class Tensor:
    """Array like PyTorch's: not a subclass of any NumPy class, and not iterable if it has no dimensions."""

    def __init__(self, data: Any) -> None:
        self.data = np.asarray(data)
        self.ndim = self.data.ndim

    def item(self) -> Any:
        return self.data.item()

    def tolist(self) -> Any:
        return self.data.tolist()

    def __iter__(self) -> Iterator[Any]:
        if not self.ndim:
            raise TypeError("iteration over a 0-d tensor")
        return iter(self.data)


class Frame:
    """Table like pandas': iterating over it yields the names of its columns."""

    ndim = 2

    def to_numpy(self) -> np.ndarray:
        return np.array([[1.0, 2.0], [3.0, 4.0]])

    def __iter__(self) -> Iterator[str]:
        return iter(["a", "b"])


WHOLE: dict[str, Callable[[int], Any]] = {
    "int64": np.int64, "uint8": np.uint8, "array": np.array, "tensor": Tensor,
}  # fmt: skip
REAL: dict[str, Callable[[float], Any]] = {
    "float32": np.float32, "longdouble": np.longdouble, "half": np.float16, "array": np.array, "tensor": Tensor, "Decimal": Decimal,
    "Fraction": Fraction,
}  # fmt: skip


@pytest.mark.parametrize("of", WHOLE.values(), ids=WHOLE)
def test_a_whole_number_is_taken(of: Callable[[int], Any]) -> None:
    with gpac.System("numbers", clock="virtual") as cell:
        fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=of(80))
        assert (fast.priority, type(fast.priority)) == (80, int)
        y = cell.svv("y", history=of(20))
        y.value = of(3)
        assert y.value == 3.0
        cell.advance(of(1))
        assert cell.now == 1.0
        n = cell.svv("n", "int32_t")
        n.value = of(7)
        assert n.value == 7


@pytest.mark.parametrize("of", REAL.values(), ids=REAL)
def test_a_number_is_taken(of: Callable[[float], Any], rig: Rig) -> None:
    cell = rig.cell
    before = cell.now
    cell.advance(of(0.25))
    assert cell.now == before + 0.25
    y, ramp = rig.svvs("y", "ramp")
    y.value = of(0.5)
    assert y.value == 0.5
    assert rig.counting().on(rig.fast)(ramp, limit=of(2.0)).last == 2
    with pytest.raises(gpac.Terminated):
        rig.counting().on(rig.fast)(ramp, time_limit=of(0.25))
    assert gpac.wait(of(0.5)) == gpac.wait(0.5)
    assert list(gpac.Pose((of(0.5), 0, 0))) == list(gpac.Pose((0.5, 0, 0)))
    assert gpac.library.gain(k=of(0.5)) is not None
    cell.svv("ranged", within=(of(0.0), of(0.5)))


def test_arrays_tensors_and_tables_are_lists_of_numbers() -> None:
    assert encoding.plain(Tensor([1.0, 2.0])) == [1.0, 2.0]
    assert encoding.plain([Tensor(1.0), np.longdouble(2)]) == [1.0, 2.0]
    assert encoding.plain(Frame()) == [[1.0, 2.0], [3.0, 4.0]]
    assert encoding.plain(np.array([1, 2], dtype=np.longdouble)) == [1.0, 2.0]
    record = np.array((1.0, 2), dtype=[("a", "<f8"), ("b", "<i4")])
    assert encoding.plain(record) == encoding.plain(record[()]) == {"a": 1.0, "b": 2}


class Series:
    """Column like pandas': not a sequence, but with a length, numbers and labels."""

    ndim = 1

    def __init__(self, data: Any) -> None:
        self.data = np.asarray(data, dtype=float)

    def to_numpy(self) -> np.ndarray:
        return self.data

    def __len__(self) -> int:
        return len(self.data)

    def __iter__(self) -> Iterator[float]:
        return iter(self.data)


@pytest.mark.parametrize("of", [np.array, Tensor, Series])
def test_several_numbers_of_an_arm_are_taken(of: Callable[[Any], Any]) -> None:
    arm = gpac.robots.load("ur5e", clock="virtual")
    with arm.system:
        arm.enable()
        home, pose = np.array(arm.values("home")), np.array([*arm.pose()])
        arm.payload = gpac.robots.Payload(of(1.0) if of is not Series else 1.0, of([0.0, 0.0, 0.1]))
        assert arm.payload == gpac.robots.Payload(1.0, (0.0, 0.0, 0.1))
        arm.max_acceleration = of(np.full(6, 3.0))
        assert arm.values("max_acceleration") == [3.0] * 6
        assert gpac.motion.move_absolute(arm, of(home + 0.05)).condition == "arrived"
        assert gpac.motion.move_linear(arm, of(pose)).condition == "arrived"
        assert np.allclose(arm.inverse(of(pose), near=of(home)), home, atol=1e-6)
        assert arm.forward(of(home)) == arm.forward(home.tolist())
        arm.tool = of([0.0, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0])
        assert gpac.Pose(of([0.1, 0.2, 0.3])) == gpac.Pose((0.1, 0.2, 0.3))


def test_behind_a_mask_there_is_no_number() -> None:
    whole = np.ma.array([1.0, 2.0])
    assert encoding.plain(whole) == [1.0, 2.0] and encoding.plain(np.ma.array(3.0)) == 3.0
    for masked, said in {
        "element": (np.ma.array([1.0, 2.0, 3.0], mask=[False, True, False]), r"'goal' is an array whose element 1 \(from 0\) is masked"),
        "whole": (np.ma.masked, r"'goal' is a masked value, which has no value; give every element a value"),
        "in a list": ([1.0, np.ma.masked], r"'goal' is a masked value"),
    }.values():
        with pytest.raises(gpac.ValueRefused, match=said):
            encoding.plain(masked, "'goal'")
    assert number(np.ma.masked) is np.ma.masked
    with gpac.System("masked", clock="virtual") as cell:
        with pytest.raises(gpac.Error):
            cell.advance(np.ma.masked)  # pyright: ignore[reportArgumentType]
        with pytest.raises(gpac.ValueRefused, match="masked"):
            cell.svv("y").value = np.ma.masked


def test_what_is_no_single_number_is_refused_in_words() -> None:
    for wrong in (np.array([1, 2]), Tensor([1.0]), "80", True, np.True_, 2.5, None):
        with gpac.System("numbers", clock="virtual") as cell, pytest.raises(gpac.CallError, match="priority"):
            cell.processor("rtp0").timer("fast", period="1 ms", priority=wrong)  # pyright: ignore[reportArgumentType]
    assert number([1]) == [1] and number("1") == "1"
    assert number(np.datetime64("2026-01-01")) == np.datetime64("2026-01-01")
    with pytest.raises(gpac.Error):
        encoding.plain(np.float64("nan"))
