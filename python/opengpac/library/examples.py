# SPDX-License-Identifier: Apache-2.0
"""Example code in a manual for trying out a block: complete Python that ends with the trial."""

from __future__ import annotations

import json
from typing import Any

from .. import _native
from ..definition.blocks import Block, Item
from ..errors import refusals
from ..values.arrays import np
from ..values.encoding import dtype_of, from_bytes
from .components import Component, items_of

_ARM = 'arm = gpac.robots.load("two_joint")'
_TOOL = "tool = lib.forward_kinematics.run(chain=arm.chain, q=[0.5, 0.7])"
_VIA = "via = lib.forward_kinematics.run(chain=arm.chain, q=[0.5, 0.6])"
_PATH = "planned = lib.path_planner.run(start=[0.0, 0.0], points=np.ones((64, 16)))"
_LINE = "planned = lib.line_planner.run(chain=arm.chain, start=[0.5, 0.5], goal=tool.pose[0])"
_POLYLINE = "planned = lib.polyline_planner.run(chain=arm.chain, start=[0.5, 0.5], poses=np.tile(tool.pose[0], (64, 1)))"

_LONG_PATH = "planned = lib.long_path_planner.run(start=[0.0, 0.0], points=np.ones((4096, 16)), blend=np.zeros(4096), speed=np.ones(4096))"
_LONG_POLYLINE = (
    "planned = lib.long_polyline_planner.run(chain=arm.chain, start=[0.5, 0.5], poses=np.tile(tool.pose[0], (4096, 1)), "
    "blend=np.zeros(4096), speed=np.ones(4096))"
)

_WRITTEN = {
    "action_chunk": ["lib.action_chunk.run(n=3, actions=[0.0, 0.1, 0.2], number=1, observed=0, present=0.0)"],
    "forward_kinematics": [_ARM, "lib.forward_kinematics.run(chain=arm.chain, q=[0.5, 0.7])"],
    "jacobian": [_ARM, "lib.jacobian.run(chain=arm.chain, q=[0.5, 0.7])"],
    "inverse_dynamics": [_ARM, "lib.inverse_dynamics.run(**arm.dynamics.parameters, q=[0.5, 0.7])"],
    "payload_effort": [_ARM, "lib.payload_effort.run(chain=arm.chain, q=[0.5, 0.7], mass=2.0)"],
    "inverse_kinematics": [_ARM, _TOOL, "lib.inverse_kinematics.run(chain=arm.chain, goal=tool.pose[0], near=[0.4, 0.4])"],
    "differential_kinematics": [_ARM, _TOOL, "lib.differential_kinematics.run(chain=arm.chain, pose=tool.pose[0], start=[0.5, 0.5])"],
    "arc_planner": [_ARM, _TOOL, _VIA, "lib.arc_planner.run(chain=arm.chain, start=[0.5, 0.5], via=via.pose[0], goal=tool.pose[0])"],
    "tool_velocity_generator": [
        _ARM,
        "lib.tool_velocity_generator.run(n=2, chain=arm.chain, start=[0.5, 0.5], velocity=[0.05, 0.0, 0.0])",
    ],
    "line_planner": [_ARM, _TOOL, _LINE.removeprefix("planned = ")],
    "line_generator": [_ARM, _TOOL, _LINE, "lib.line_generator.run(n=2, chain=arm.chain, line=planned.line[0])"],
    "path_planner": [_PATH.removeprefix("planned = ")],
    "path_generator": [_PATH, "lib.path_generator.run(n=2, path=planned.path[0])"],
    "long_path_planner": [_LONG_PATH.removeprefix("planned = ")],
    "long_path_generator": [_LONG_PATH, "lib.long_path_generator.run(n=2, path=planned.path[0])"],
    "polyline_planner": [_ARM, _TOOL, _POLYLINE.removeprefix("planned = ")],
    "polyline_generator": [_ARM, _TOOL, _POLYLINE, "lib.polyline_generator.run(n=2, chain=arm.chain, path=planned.path[0])"],
    "long_polyline_planner": [_ARM, _TOOL, _LONG_POLYLINE.removeprefix("planned = ")],
    "long_polyline_generator": [_ARM, _TOOL, _LONG_POLYLINE, "lib.long_polyline_generator.run(n=2, chain=arm.chain, path=planned.path[0])"],
}
"""Handwritten examples for blocks that take the geometry of an arm, or the output of another block's planner."""


def example(component: Component) -> list[str]:
    """Returns the lines that try out a block: a handwritten example, or else one value for each input that must be bound, and two
    parameters."""
    written = _WRITTEN.get(component.short_name) if component.origin == "library" else None
    return written or [_made(component)]


def _made(component: Component) -> str:
    block: Block = component.value
    given: dict[str, Any] = {}
    for item in items_of(block).values():
        # A struct, or an array of structs, is the result of another block, too long to be written.
        if item.kind in ("input", "device_read") and not item.has_default and item.type.partition("[")[0] not in block.types:
            given[item.name] = _one(block, item)
    parameters = [i for i in items_of(block).values() if i.kind == "parameter"]
    for item in parameters if any(i.sized for i in parameters) else parameters[:2]:
        value = default_of(block, item)
        if item.type not in block.types and np.all(np.isfinite(np.asarray(value, dtype=float))):
            given[item.name] = value.tolist() if isinstance(value, np.ndarray) else value
    arguments = ", ".join(f"{name}={value!r}" for name, value in given.items())
    return f"lib.{component.short_name}.run({arguments})"


def _one(block: Block, item: Item) -> Any:
    """Returns an example value for an input: ones, in the shape of its type."""
    value = default_of(block, item)
    if isinstance(value, np.ndarray) and value.dtype.names is None:
        return np.ones_like(value).tolist()
    if isinstance(value, bool | int | float):
        return type(value)(1)
    return {name: np.ones_like(value[name]).tolist() for name in value.dtype.names}


def default_of(block: Block, item: Item) -> Any:
    """Returns the default of a parameter or input, or the preset of a condition. For a sized item, the default has the minimum number of
    elements."""
    text = item.type
    if item.sized:
        size = next(i for i in block.items.values() if i.kind == "size")
        text = text.replace(f"[{size.name}]", f"[{max(size.least, 2) if size.most > 1 else 1}]")
    with refusals:
        dtype = dtype_of(json.loads(_native.type_json(text, json.dumps(block.types))))
    return from_bytes(item.initial[: dtype.itemsize], dtype)
