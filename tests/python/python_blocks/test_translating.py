# SPDX-License-Identifier: Apache-2.0
"""A function gives the same bits as C generated from LLVM's text and as LLVM's own assembly, and the same values as in Python."""

import math
from pathlib import Path
from typing import Annotated as A
from typing import Any

import numpy as np
import pytest

import opengpac as gpac
from opengpac.python import Condition, Input, Output, Parameter, State, compiling
from opengpac.python.translating import Untranslatable, translated


def numbers(
    u: A[float, Input()],
    i: A[int, Input()],
    q: A[np.ndarray, Input(type="double[4]")],
    small: A[int, Input(type="uint8_t")],
    real: A[float, Output(nonfinite=True)],
    whole: A[int, Output()],
    other: A[int, Output()],
    brief: A[int, Output(type="int16_t")],
    sorted_q: A[np.ndarray, Output(type="double[4]")],
    most: A[int, Output()],
    high: A[bool, Condition()],
    x: A[np.ndarray, State(type="double[2][2]")] = ((1.0, 0.5), (0.0, -1.0)),  # type: ignore[assignment]
    k: A[float, Parameter()] = 0.3,
):
    """Uses each operator, loops, arrays, and functions of libm."""
    real = math.sin(u) * math.exp(-abs(u)) + math.atan2(u, 2.0) - math.hypot(u, k) + u**3 + math.floor(u)
    real += max(u, k) - min(u, -k) + math.copysign(k, u) + round(u) + (u % 0.4) + (u // 0.4) + math.sqrt(abs(u))
    whole = i // 7 + i % 7 - (-i) // 5 + (i << 2) - (i >> 1) + (i & 12) + (i | 3) + (i ^ 5) + abs(i) + int(u) + i * i
    other = 0
    n = abs(i)
    while n != 1 and other < 50 and n > 0:
        n = n // 2 if n % 2 == 0 else 3 * n + 1
        other += 1
    brief = (small * 3 + i) % 100
    for a in range(4):
        sorted_q[a] = q[a]
    for a in range(4):
        for b in range(3 - a):
            if sorted_q[b] > sorted_q[b + 1]:
                held = sorted_q[b]
                sorted_q[b] = sorted_q[b + 1]
                sorted_q[b + 1] = held
    most = 0
    for a in range(len(q)):
        most = a if q[a] > q[most] else most
    x[0, 0] = 0.9 * x[0, 0] + 0.1 * u
    x[1, most % 2] += x[0, 0] * k
    real += x[1, 0] - x[1, 1]
    high = real > 1 or (i > 10 and u != k)
    return whole, other, brief, most, high


def outcome(block: Any, given: dict[str, Any]) -> Any:
    tried = block.run(**given)
    assert tried.fault is None, tried.fault
    return {name: values.tobytes() for name, values in tried.outputs.items()}, tried.conditions


def test_c_and_assembly_give_the_same_bits_and_python_the_same_numbers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    random = np.random.default_rng(5)
    given = {
        "u": random.normal(size=400), "i": random.integers(-1000, 1000, 400).tolist(), "q": random.normal(size=(400, 4)),
        "small": random.integers(0, 256, 400).tolist(),
    }  # fmt: skip
    told: list[str] = []
    with monkeypatch.context() as patch:
        patch.setenv("OPENGPAC_COMPILED", str(tmp_path / "c"))
        patch.setattr(compiling, "translated", lambda *text: told.append(translated(*text)) or told[-1])
        expected = outcome(gpac.block(numbers), given)
    assert len(told) == 1 and "goto" in told[0], "it was translated"

    def unknown(*text: str) -> str:
        raise Untranslatable("for this test")

    with monkeypatch.context() as patch:
        patch.setenv("OPENGPAC_COMPILED", str(tmp_path / "assembly"))
        patch.setattr(compiling, "translated", unknown)
        assert outcome(gpac.block(numbers), given) == expected
    values, conditions = outcome(gpac.block(native=False)(numbers), given)
    # numba multiplies, while Python calls pow.
    np.testing.assert_allclose(np.frombuffer(values.pop("real")), np.frombuffer(expected[0].pop("real")), rtol=1e-12, atol=1e-12)
    assert (values, conditions) == expected


@pytest.mark.parametrize("line", ["%a = insertvalue { double, i1 } undef, double %u, 0", "%a = fadd <2 x double> %x, %x", "fence seq_cst"])
def test_what_is_not_known_is_not_translated(line: str) -> None:
    with pytest.raises(Untranslatable):
        translated(f"define i32 @body(double %u) {{\n  {line}\n  ret i32 0\n}}\n", "body")
