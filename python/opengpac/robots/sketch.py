# SPDX-License-Identifier: Apache-2.0
"""Drawings of arms as SVG: the chain of joints at home, with the axis of each joint and the tool frame."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

SIZE, MARGIN = 200.0, 22.0
"""Size (width and height) of a drawing, and its margin, px."""
TICK = 0.06
"""Length of a joint's axis in each direction, and of the tool's axes, as a fraction of the drawing."""
_VIEW = np.array([[0.87, -0.5, 0.0], [-0.29, -0.5, 0.82]])
"""Projection of a point of the model onto the drawing, to the right and up, viewed from the front, the right and above."""


def chain(arm: Any, q: Sequence[float]) -> dict[str, Any]:
    """Returns the points of an arm's joints at these positions, the directions of their axes, and the tool frame, as lists of numbers,
    m."""
    placed = np.eye(4)
    points, directions = [], []
    for axis, position in zip(arm.kinematics.axes, q, strict=True):
        if axis.kind == 0:
            continue
        point, direction = np.array(axis.point), np.array(axis.direction)
        points.append((placed[:3, :3] @ point + placed[:3, 3]).tolist())
        directions.append((placed[:3, :3] @ direction).tolist())
        placed = placed @ _moved(point, direction, position, axis.kind)
    tool = arm.forward(q).matrix
    return {"points": points, "directions": directions, "tool": tool.tolist()}


def _moved(point: np.ndarray, direction: np.ndarray, position: float, kind: int) -> np.ndarray:
    """Applies a joint's motion to a point: a rotation about an axis, or a translation along it."""
    found = np.eye(4)
    if kind == 2:
        found[:3, 3] = direction * position
        return found
    x, y, z = direction
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    found[:3, :3] = np.eye(3) + np.sin(position) * cross + (1.0 - np.cos(position)) * cross @ cross
    found[:3, 3] = point - found[:3, :3] @ point
    return found


def drawn(name: str, of: dict[str, Any]) -> str:
    """Draws a chain."""
    points, directions, tool = np.array(of["points"]), np.array(of["directions"]), np.array(of["tool"])
    foot = np.array([points[0][0], points[0][1], min(0.0, points[:, 2].min())])
    line = np.vstack([foot, points, tool[:3, 3]])
    flat = line @ _VIEW.T
    low, high = flat.min(axis=0), flat.max(axis=0)
    span = max(float((high - low).max()), 1e-3)
    scale = (SIZE - 2 * MARGIN) / span
    middle = (low + high) / 2

    def place(point: np.ndarray) -> tuple[float, float]:
        right, up = (np.asarray(point) @ _VIEW.T - middle) * scale
        return round(SIZE / 2 + float(right), 1), round(SIZE / 2 - float(up), 1)

    def stroke(ends: Sequence[np.ndarray], colour: str, width: float) -> str:
        path = " ".join(f"{x},{y}" for x, y in map(place, ends))
        return f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="{width}"/>'

    x, y = place(foot)
    parts = [f'<ellipse cx="{x}" cy="{y}" rx="14" ry="6" fill="#8a94a0"/>', stroke(list(line), "#8a94a0", 6)]
    for point, direction in zip(points, directions, strict=True):
        parts.append(stroke([point - TICK * span * direction, point + TICK * span * direction], "#2f6fdd", 2))
        x, y = place(point)
        parts.append(f'<circle cx="{x}" cy="{y}" r="4.5" fill="#2f6fdd"/>')
    for axis, colour in enumerate(("#d64545", "#2e9e5b", "#2f6fdd")):
        parts.append(stroke([tool[:3, 3], tool[:3, 3] + 1.6 * TICK * span * tool[:3, axis]], colour, 2.5))
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {SIZE:g} {SIZE:g}" stroke-linecap="round" stroke-linejoin="round">'
        f"<title>{name} at its home</title>\n" + "\n".join(parts) + "\n</svg>\n"
    )
