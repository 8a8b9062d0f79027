# SPDX-License-Identifier: Apache-2.0
"""Checks for the parts of a driver class: each part must stay at rest when it is not commanded, follow its commands, and report its
motion."""

from __future__ import annotations

import time
from typing import Any

from ..driver.members import Part
from .class_subject import Subject, Wrong, opened, said

PUSHED = 20
"""Number of exchanges while a part is pushed, `PAUSE_S` apart, because machines move in wall-clock time."""
PAUSE_S = 0.01
CREEP = 0.01
"""Maximum motion, in rad or m, of a part at rest in `PUSHED` exchanges."""
MOTION = 1e-9
"""Minimum change, in rad or m, that counts as motion."""
CLEAR = 1e-4
"""Change, in rad or m, above which the direction of a motion is certain."""
OPERATING_S = 20.0
"""Time limit, in s, for a part to report that it is operating."""


class PartSubject:
    """A part under test of an open subject."""

    def __init__(self, subject: Subject, part: Part) -> None:
        self.subject, self.part = subject, part
        self.values: dict[str, Any] = vars(subject.driver.__dict__[part.name])
        self.command = f"{part.name}.{'goal' if part.command == 'position' else 'effort'}"

    def exchange(self, command: float | None) -> None:
        """Performs one exchange that commands only this part, or, with None, no part."""
        commanded = {} if command is None else {self.command: command}
        engaged = bytes(channel.name in commanded for channel in self.subject.writes)
        try:
            self.subject.exchange(lambda channel: commanded.get(channel.name, channel.initial), engaged)
        except (Exception, SystemExit) as why:
            raise Wrong(f"exchange() raises {said(why)} while part '{self.part.name}' is commanded to move slightly") from why
        time.sleep(PAUSE_S)

    def rests(self) -> None:
        """Fails if the part creeps while it should be at rest."""
        self.exchange(None)
        start = self.values["position"]
        for _ in range(PUSHED):
            self.exchange(None)
        if abs(self.values["position"] - start) > CREEP:
            raise Wrong(f"part '{self.part.name}' moves from {start} to {self.values['position']} without a command")

    def push(self, sign: float) -> tuple[float, float]:
        """Pushes the part gently in one direction. Returns the distance moved and the mean velocity."""
        start, velocities = self.values["position"], []
        limits = self.part.limits
        for number in range(1, PUSHED + 1):
            if self.part.command == "position":
                command = start + sign * number * min(0.2 * limits["speed_max"] * PAUSE_S, 1e-3)
            else:
                command = self.values["bias"] + sign * min(0.05 * limits["effort_max"], 1.0)
            self.exchange(command)
            velocities.append(self.values["velocity"])
        return self.values["position"] - start, sum(velocities) / PUSHED

    def is_ready(self) -> bool:
        """Engages the part at its position; returns whether it becomes operational within the time limit."""
        end_s = time.monotonic() + OPERATING_S
        while time.monotonic() < end_s:
            self.exchange(self.values["position" if self.part.command == "position" else "bias"])
            if self.values.get("operating", True):
                return True
        return False


def parts(options: str) -> None:
    with opened(options) as subject:
        for part in type(subject.driver).members(Part).values():
            one = PartSubject(subject, part)
            one.rests()
            if not one.is_ready():
                raise Wrong(f"part '{part.name}' has been engaged for {OPERATING_S:.0f} s but does not report 'operating'")
            pushes = [one.push(1.0), one.push(-1.0)]
            (up, _), (down, _) = pushes
            if abs(up) < MOTION and abs(down) < MOTION:
                ignored = "the command is ignored, or the reading is frozen"
                raise Wrong(
                    f"the position of part '{part.name}' does not change when it is commanded to move in either direction: {ignored}"
                )
            if up - down < MOTION:
                raise Wrong(
                    f"the position of part '{part.name}' changes by {up:.3g} when it is commanded to move up, and by {down:.3g} when down"
                )
            for distance, velocity in pushes:
                if abs(distance) > CLEAR and distance * velocity <= 0:
                    raise Wrong(f"the position of part '{part.name}' changes by {distance:.3g} while its velocity is {velocity:.3g}")
