# SPDX-License-Identifier: Apache-2.0
"""A queue of moves of an arm: `with arm.queue() as moves:` appends moves while earlier ones run."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Sequence
from types import TracebackType
from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np

from .. import library
from ..application.instances import VerbInstance
from ..cell.signals import DigitalOutput
from ..definition.modules import StructType
from ..devices.groups import Group
from ..errors import InvalidState, OutOfRange, refuse
from ..robots.generators import Values
from ..values.frames import Pose
from ..values.numbers import number
from ..values.quantities import Quantity, span_ns
from . import queue_rows as rows
from .queue_rows import At
from .queue_verb import MoveEnd, QueueReport, ends_of, move_queue, move_queue_switching, no_progress

if TYPE_CHECKING:
    from ..robots.arm import Arm
    from ..system.svvs import SVV

Mode = Literal["blending", "buffered", "aborting"]
_LOOK_S = 0.002
"""Interval at which a program polls for a free slot in the queue, under the monotonic clock."""
_NEAR = 1e-9
"""Tolerance, as a fraction of a move, within which the arm counts as being at the end of the move."""


class MoveQueue:
    """A queue of moves of an arm, which starts moving when the first one is appended. Created by `arm.queue()`, for a `with` statement.

    At the end of the statement, the program waits for the end of the last move; `report` is the end report. An exception in the
    statement halts the arm on its path.

    Each move is appended to the end of the path: `joints`, `linear` and `circular` return its number, from 1. `blend` is the radius
    with which the corner at its goal is rounded off, if the next move is appended in time; without a blend, the arm stops at the
    goal. Up to sixteen moves may wait; then a call blocks until the arm begins one of them. Invalid arguments are refused when the
    move is appended. A move that the arm cannot make is refused before any part of it is executed, and raises `MoveRefused` at the
    end of the statement at the latest.

    `rate`, between -1 and 1, scales the speed along the path: at 0 the arm pauses on the path, and below 0 it moves back along the
    path. `arm.override` and `cell.override` also scale the speed. None of them changes the path.
    """

    def __init__(self, arm: Arm, tolerance: float = 0.002, outputs: Sequence[DigitalOutput] = (), rate: float = 1.0) -> None:
        self.arm = arm
        self.outputs = tuple(outputs)
        self.report: QueueReport | None = None
        self._tolerance, self._rate = tolerance, rate
        self._until: int | None = None
        self._is_stopped = False
        self._rows = [rows.empty_row() for _ in range(rows.WAITING_MAX)]
        self._count = 0
        self._joints: Sequence[float] | None = None
        self._instance: VerbInstance[QueueReport] | None = None

    def __enter__(self) -> Self:
        if self._instance is not None:
            refuse(InvalidState, f"the queue of '{self.arm.name}' has already been used", "create another one: arm.queue()")
        self._joints = [float(q) for q in self.arm.values("commanded")]
        # The progress of the queue before would count for this one until the arm begins.
        self.svv.value = no_progress()
        if self.outputs:
            outputs = Group(f"outputs of {self.arm.name}", *self.outputs)
            self._instance = move_queue_switching.asynch(self.arm, outputs, self.svv, self._moves(), self._rate, self._tolerance)
        else:
            self._instance = move_queue.asynch(self.arm, self.svv, self._moves(), self._rate, self._tolerance)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if kind is None and not self._is_stopped:
            self.report = self._close()
            return
        instance = self._instance
        if instance is not None and instance.state in ("queued", "running", "suspended"):
            with contextlib.suppress(InvalidState):
                instance.halt()
        if instance is not None and instance.state != "deleted":
            instance.delete()

    @property
    def svv(self) -> SVV[np.ndarray]:
        """SVV with the progress: the `number` of the current move, its completed `fraction`, and the `ends` of the last 32 moves."""
        types = library.queue_generator.types
        kind = StructType("queue_progress", types["queue_progress"], types)
        return self.arm.system.svv(f"{self.arm.name}.queue", kind)

    @property
    def number(self) -> int:
        """Number of the current move, from 1; 0 before the first. The first half of a blend belongs to the earlier move, the second half
        to the later one."""
        return int(self.svv.value["number"])

    @property
    def fraction(self) -> float:
        """Completed fraction of the current move."""
        return float(self.svv.value["fraction"])

    @property
    def ends(self) -> list[MoveEnd]:
        """Ends of the last 32 moves: the fraction of the requested blend that was achieved, and the reason."""
        return ends_of(self.svv.value)

    @property
    def rate(self) -> float:
        """Fraction of the programmed speed, from -1 to 1; can be set. At 0 the arm pauses; with a negative value it moves back along the
        path."""
        return float(self._running().inputs["rate"])

    @rate.setter
    def rate(self, rate: float) -> None:
        instance = self._running()
        instance.set(rate=rate)
        if self._until is not None:
            self._until = None
            self._send()

    @property
    def resting(self) -> bool:
        """True if the set-point is at rest."""
        return bool(self.svv.value["resting"])

    def step(self, moves: int = 1) -> None:
        """Continues to the end of the current move, or of a later one, and returns when the arm has come to rest there. If `moves` is
        negative, moves back along the path.

        moves: number of boundaries between moves to reach, 1 to 16, or -1 to -16. The boundary of two blended moves is the midpoint
        of the blend. If the arm is moving and is too close to the boundary to stop there, it comes to rest as soon as possible. `rate
        = 1` resumes the motion without steps.
        """
        count = number(moves)
        most = rows.WAITING_MAX
        if not isinstance(count, int) or isinstance(count, bool) or not 1 <= abs(count) <= most:
            refuse(
                OutOfRange,
                f"'moves' is {moves!r:.80}, but its range is 1 to {most}, or -1 to -{most}",
                "pass a number of moves in this range",
            )
        instance, now = self._running(), self.svv.value
        place = max(int(now["number"]) - 1, 0) + float(now["fraction"])
        until = math.floor(place + _NEAR) + count if count > 0 else math.ceil(place - _NEAR) + count
        self._until = min(max(until, 0), self._count)
        rate = abs(self.rate) or 1.0
        self._wait(lambda: int(self.svv.value["taken"]) >= (self._until or 0), "1 h")
        self._send()
        instance.set(rate=rate if count > 0 else -rate)

        def rests() -> bool:
            progress = self.svv.value
            return int(progress["until"]) == self._until and bool(progress["resting"])

        self._wait(rests, "1 h")

    def stop(self, category: Literal[1, 2] = 2) -> None:
        """Brings the arm to rest on its path, with a stop category of IEC 60204-1, and returns when it is at rest.

        category: with 2, the drives hold the arm there until `rate` is set; with 1, the drives are then switched off, and the queue
        ends. This is a stop by the program; for category 0, use `cell.emergency_stop(reason)`.
        """
        if category not in (1, 2):
            refuse(
                OutOfRange,
                f"'category' must be 1 or 2, not {category!r:.80}",
                "pass 1 or 2; for category 0, call cell.emergency_stop(reason)",
            )
        self.rate = 0.0
        self._wait(lambda: self.resting, "1 h")
        if category == 1:
            self._is_stopped = True
            self.arm.disable()

    def joints(
        self,
        goal: Values | dict[str, float | str],
        speed: Values = "30 %",
        acceleration: Values = "100 %",
        *,
        duration: Quantity | None = None,
        blend: float | str = 0.0,
        mode: Mode = "blending",
        marks: Sequence[At] = (),
    ) -> int:
        """Appends a move of the joints on a straight line in joint space. Returns its number.

        goal: rad (m), one for each joint, or only some joints by name if the previous move was a move of the joints; speed: rad/s
        (m/s) or a fraction of `max_speed`; acceleration: rad/s² or a fraction of `max_acceleration`; duration: time from rest to
        rest, `"2 s"`, achieved by a lower speed; if it is shorter than the limits permit, `MoveRefused` gives the minimum; blend: rad
        of the joint that moves furthest, or a fraction of the path, `"20 %"`, at most half of this move and of the next; mode:
        `"blending"` continues from the previous move along its blend; `"buffered"` stops before this move, regardless of that blend;
        `"aborting"` replaces the rest of the path: waiting moves are dropped, and the arm blends from its current motion into this
        move, or, if it cannot, first comes to rest on the path; marks: outputs that are switched along the path,
        `gpac.motion.at(…)`, at most four.
        """
        arm = self.arm
        goals = rows.goals_of(arm, goal, self._joints)
        row = {
            "duration": rows.duration_of(duration),
            "kind": rows.JOINTS, "joints": rows.padded(goals), **rows.blend_of(blend, rows.JOINTS),
            "marks": rows.marks_of(marks, self.outputs, rows.JOINTS),
            "speed": rows.padded(rows.shares_of(arm, speed, "max_speed", "rad/s", "speed")),
            "acceleration": rows.padded(rows.shares_of(arm, acceleration, "max_acceleration", "rad/s^2", "acceleration")),
        }  # fmt: skip
        found = self._append(row, mode)
        self._joints = goals
        return found

    def linear(
        self,
        pose: Pose | Sequence[float] | np.ndarray,
        speed: float | str = 0.25,
        angular_speed: float | str = 1.0,
        acceleration: float | str = 1.0,
        *,
        frame: Pose | Sequence[float] | None = None,
        duration: Quantity | None = None,
        blend: float | str = 0.0,
        mode: Mode = "blending",
        marks: Sequence[At] = (),
    ) -> int:
        """Appends a move of the tool along a straight line to a pose, turning it uniformly about one axis. Returns its number.

        pose: `gpac.Pose`, or x y z (m) and quaternion w x y z; speed: m/s; angular_speed: rad/s; acceleration: m/s²; blend: a
        distance of the tool, `"10 mm"`, an angle of its orientation, `"10 deg"`, or a fraction of the path, `"20 %"`, at most half of
        this move and of the next; frame: the work frame of the pose, `points.frames["table"]`; duration, mode and marks: as in
        `joints`.
        """
        row = {"kind": rows.LINE, "pose": rows.pose_of(pose, frame), **rows.blend_of(blend, rows.LINE)}
        row["duration"] = rows.duration_of(duration)
        row["marks"] = rows.marks_of(marks, self.outputs, rows.LINE)
        return self._append({**row, **rows.tool_row(speed, angular_speed, acceleration)}, mode)

    def circular(
        self,
        via: Pose | Sequence[float] | np.ndarray,
        goal: Pose | Sequence[float] | np.ndarray,
        speed: float | str = 0.25,
        angular_speed: float | str = 1.0,
        acceleration: float | str = 1.0,
        *,
        angle: float | str = 0.0,
        orientation: Literal["via", "goal", "path"] = "via",
        frame: Pose | Sequence[float] | None = None,
        duration: Quantity | None = None,
        blend: float | str = 0.0,
        mode: Mode = "blending",
        marks: Sequence[At] = (),
    ) -> int:
        """Appends a move of the tool along an arc through an intermediate pose to a goal. Returns its number.

        via, goal, angle and orientation are as in `gpac.motion.move_circular`; the other parameters are as in `linear`.
        """
        turned = rows.value_of(angle, "rad", "angle", -1e-300)
        row = {
            "kind": rows.ARC, "via": rows.pose_of(via, frame), "pose": rows.pose_of(goal, frame), "angle": turned,
            "duration": rows.duration_of(duration),
            "orientation": rows.orientation_of(orientation), **rows.blend_of(blend, rows.ARC),
            "marks": rows.marks_of(marks, self.outputs, rows.ARC),
        }  # fmt: skip
        return self._append({**row, **rows.tool_row(speed, angular_speed, acceleration)}, mode)

    def wait(self, move: int, fraction: float = 1.0, within: float | str = "1 h") -> None:
        """Waits until the arm has completed a move, or a fraction of it. Raises `TimeoutError` after `within`, and the error of the
        queue if the queue ends first."""
        if not 1 <= number(move) <= self._count:
            refuse(OutOfRange, f"'move' is {move}, but only {self._count} moves were appended", "pass the number that a move returned")

        def is_there() -> bool:
            now = self.svv.value
            return (int(now["number"]), float(now["fraction"])) >= (move, min(fraction, 1.0))

        self._wait(is_there, within)

    def halt(self) -> None:
        """Brings the arm to rest on its path and ends the queue. Returns when the arm is at rest; moves that were not completed are
        dropped."""
        self._running().halt()

    def _append(self, row: dict[str, Any], mode: str) -> int:
        given = rows.mode_of(mode)
        self._running()
        count = self._count + 1
        if mode != "aborting":
            # An aborting move overwrites a row of a move that it drops.
            self._wait(lambda: int(self.svv.value["taken"]) >= count - rows.WAITING_MAX, "1 h")
        if row["kind"] in (rows.LINE, rows.ARC):
            self._joints = None
        self._rows[count % rows.WAITING_MAX] = {**rows.empty_row(), **row, "number": count, "mode": given}
        self._send()
        self._count = count
        return count

    def _send(self) -> None:
        """Sends the waiting moves, and the boundary at which a single step ends, to the real-time system."""
        self._running().set(moves=rows.waiting_moves(self._moves(), {}))

    def _moves(self) -> rows.WaitingMoves:
        """Returns the rows of the waiting moves, and the boundary at which a single step ends."""
        return rows.WaitingMoves(self._rows, self._until)

    def _close(self) -> QueueReport:
        instance = self._running()
        if not instance.done:
            self._append({"kind": rows.CLOSE}, "buffered")
        return instance.wait()

    def _running(self) -> VerbInstance[QueueReport]:
        """Returns the verb instance; raises its error if it has ended."""
        instance = self._instance
        if instance is None:
            refuse(InvalidState, f"the queue of '{self.arm.name}' has not been started", "write: with arm.queue() as moves: …")
        return instance

    def _wait(self, until: Callable[[], bool], within: float | str) -> None:
        """Waits until a predicate is true; raises the error of the queue if the queue ends first."""
        instance, system = self._running(), self.arm.system

        def is_over() -> bool:
            return until() or instance.done

        if system.virtual:
            system.advance(until=is_over, within=within)
        else:
            deadline = system.now + span_ns(within, "within") * 1e-9
            while not is_over():
                if system.now > deadline:
                    raise TimeoutError(f"the queue of '{self.arm.name}' did not reach the awaited state within {within}")
                time.sleep(_LOOK_S)
        if not until():
            instance.wait()
            refuse(InvalidState, f"the queue of '{self.arm.name}' has ended", "create another one: arm.queue()")
