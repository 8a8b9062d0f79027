# SPDX-License-Identifier: Apache-2.0
"""Symbolic functions, drawn by seed, with points at which they are evaluated."""

from __future__ import annotations

import casadi as ca
import numpy as np

SEEDS = range(24)
POINTS = 5


def drawn(seed: int) -> tuple[ca.Function, dict[str, np.ndarray]]:
    """Returns a function of up to four arguments and three results, of SX or MX, with shapes from scalars to matrices."""
    random = np.random.default_rng(seed)
    kind = ca.SX if seed % 2 else ca.MX
    count = int(random.integers(1, 5))
    shapes = [tuple(random.integers(1, 4, 2)) if random.random() < 0.4 else (int(random.integers(1, 5)), 1) for _ in range(count)]
    inputs = [kind.sym(f"u{i}", int(r), int(c)) for i, (r, c) in enumerate(shapes)]
    made = [part for u in inputs for part in ca.vertsplit(ca.vec(u))]
    for _ in range(int(random.integers(10, 60))):
        a, b = (made[int(i)] for i in random.integers(0, len(made), 2))
        made.append(OPERATIONS[int(random.integers(len(OPERATIONS)))](a, b))
    outputs = []
    for _ in range(int(random.integers(1, 4))):
        rows, columns = (int(n) for n in random.integers(1, 4, 2))
        parts = [made[-1 - int(i)] for i in random.integers(0, min(12, len(made)), rows * columns)]
        outputs.append(ca.reshape(ca.vertcat(*parts), rows, columns))
    names = [f"u{i}" for i in range(len(inputs))], [f"y{i}" for i in range(len(outputs))]
    points = {f"u{i}": random.normal(size=(POINTS, int(r), int(c))) for i, (r, c) in enumerate(shapes)}
    flat = {name: p.reshape(POINTS) if p[0].size == 1 else p.reshape(POINTS, -1) if 1 in p[0].shape else p for name, p in points.items()}
    return ca.Function(f"drawn{seed}", inputs, outputs, *names), flat


OPERATIONS = [
    lambda a, b: a + b,
    lambda a, b: a - 2 * b,
    lambda a, b: a * b / (1 + b * b),
    lambda a, b: a / (1.5 + ca.cos(b)),
    lambda a, b: ca.sin(a) + b,
    lambda a, b: ca.atan2(a, 1 + b * b),
    lambda a, b: ca.tanh(a) * b,
    lambda a, b: ca.sqrt(1 + a * a) - b,
    lambda a, b: ca.fmin(a, b),
    lambda a, b: ca.fmax(a, ca.floor(b)),
    lambda a, b: ca.if_else(a > b, a, ca.tanh(b)),
    lambda a, b: ca.exp(-a * a) + ca.log(2 + b * b),
    lambda a, b: ca.fabs(a) ** 0.5 + ca.erf(b),
    lambda a, b: ca.sign(a) * ca.asinh(b),
]
