# SPDX-License-Identifier: Apache-2.0
"""Pictures of blocks of one number: their response to a step and a ramp, drawn from a trial of the block itself."""

from __future__ import annotations

from collections.abc import Sequence

from opengpac.definition.blocks import Block
from opengpac.library.components import Component, items_of

TRIED = [0.0] * 10 + [1.0] * 30 + [1.0 - (k + 1) / 20 for k in range(40)]
"""Values of the input, one per invocation: a step up, then a ramp down to -1."""

WIDTH, HEIGHT, EDGE = 460, 150, 26


def picture(component: Component) -> str | None:
    """Returns the picture of a block with one number as input and a number as its first output; `None` for other blocks."""
    block = component.value
    if not isinstance(block, Block):
        return None
    items = items_of(block).values()
    inputs = [item for item in items if item.kind == "input" and not item.has_default]
    outputs = [item for item in items if item.kind == "output"]
    if len(inputs) != 1 or not outputs or any(item.kind.startswith("device") or item.kind == "size" for item in items):
        return None
    if inputs[0].type != "double" or outputs[0].type != "double":
        return None
    taken = block.run(every="20 ms", **{inputs[0].name: TRIED})
    values = [float(value) for value in getattr(taken, outputs[0].name)]
    if taken.fault or len(values) != len(TRIED):
        return None
    return drawing(inputs[0].name, TRIED, outputs[0].name, values)


def drawing(of: str, given: Sequence[float], name: str, values: Sequence[float]) -> str:
    """Draws the input and the output as steps over the invocations."""
    low, high = min(*given, *values), max(*given, *values)
    span = (high - low) or 1.0

    def at(value: float) -> float:
        return EDGE + (high - value) / span * (HEIGHT - 2 * EDGE)

    def stairs(line: Sequence[float]) -> str:
        step = (WIDTH - 2 * EDGE - 60) / len(line)
        return "M" + "L".join(f"{EDGE + k * step:.0f},{at(value):.0f}H{EDGE + (k + 1) * step:.0f}" for k, value in enumerate(line))

    right = WIDTH - EDGE - 54
    last, axis = at(values[-1]), at(0.0) if low <= 0 <= high else HEIGHT - EDGE
    beside = at(given[-1]) if abs(at(given[-1]) - last) > 12 else last + (14 if at(given[-1]) >= last else -14)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}">'
        f"<title>{name} for a step and a ramp of {of}</title>"
        f'<g fill="none" stroke="#808080"><path d="M{EDGE},{axis:.0f}H{right}" stroke-width="0.5"/>'
        f'<path d="{stairs(given)}" stroke-dasharray="3 3"/><path d="{stairs(values)}" stroke="#2470c8" stroke-width="2"/></g>'
        f'<g font-family="sans-serif" font-size="12"><text x="{right + 4}" y="{beside + 4:.0f}" fill="#808080">{of}</text>'
        f'<text x="{right + 4}" y="{last + 4:.0f}" fill="#2470c8">{name}</text>'
        f'<text x="{EDGE}" y="{EDGE - 10}" fill="#808080">{low:.3g} to {high:.3g}, 80 invocations of 20 ms</text></g></svg>\n'
    )
