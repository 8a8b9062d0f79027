# SPDX-License-Identifier: Apache-2.0
"""Configuration of an arm, which selects one of the solutions for the joint positions that bring its tool to a pose."""

from __future__ import annotations

from dataclasses import dataclass

from ..errors import ValueRefused, refuse

_SIGNS = {"+": 1, "-": -1}
_NUMBER = 3
TURNS_MAX = 1000
"""Maximum number of turns of a joint in a configuration."""


@dataclass(frozen=True)
class Configuration:
    """Shoulder, elbow and wrist of an arm by their signs, and the turns of its joints: `arm.configuration()`.

    `shoulder` is 1 if the wrist is on the side of the first axis to which the cross product of the first two axes points, `elbow` 1
    if the forearm is bent about the third axis in its positive sense, `wrist` 1 if the sixth axis is rotated from the fourth about
    the fifth in its positive sense; otherwise they are -1. A joint between -180 and 180 degrees is at turn 0; if `turns` is empty,
    any turns are allowed. The text `"+-+"` is shoulder, elbow, wrist. Raises `ValueRefused` for an invalid sign.
    """

    shoulder: int
    elbow: int
    wrist: int
    turns: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        for name in ("shoulder", "elbow", "wrist"):
            sign = getattr(self, name)
            if isinstance(sign, bool) or not isinstance(sign, int) or sign not in (1, -1):
                refuse(ValueRefused, f"the {name} of a configuration must be 1 or -1, not {sign!r}", "write 1 or -1")
        turns = self.turns if isinstance(self.turns, tuple | list) else (None,)
        if any(isinstance(turn, bool) or not isinstance(turn, int) or abs(turn) > TURNS_MAX for turn in turns):
            refuse(ValueRefused, f"the turns of a configuration must be integers, not {self.turns!r}", "write an integer for each joint")

    @classmethod
    def of(cls, given: Configuration | str, turns: tuple[int, ...] | list[int] = ()) -> Configuration:
        """Converts a text, `"+-+"` for shoulder, elbow and wrist, to a configuration with `turns`; returns a `given` configuration
        unchanged."""
        if isinstance(given, Configuration):
            return given
        if not isinstance(given, str) or len(given) != _NUMBER or any(sign not in _SIGNS for sign in given):
            refuse(
                ValueRefused,
                f"a configuration must be three signs, not {given!r}",
                "write the signs of shoulder, elbow and wrist, for example '+-+'",
            )
        shoulder, elbow, wrist = (_SIGNS[sign] for sign in given)
        return cls(shoulder, elbow, wrist, tuple(turns) if isinstance(turns, list) else turns)

    @property
    def signs(self) -> str:
        """Signs of shoulder, elbow and wrist as text, `"+-+"`."""
        return "".join("+" if sign > 0 else "-" for sign in (self.shoulder, self.elbow, self.wrist))

    def __str__(self) -> str:
        return self.signs
