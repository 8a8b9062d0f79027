# SPDX-License-Identifier: Apache-2.0
"""An arm: a group of joints with its geometry."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Self, TypeVar

import numpy as np

from ..application.instances import VerbInstance
from ..devices.groups import Group
from ..errors import DefinitionError, Error, NotEnabled, UnknownName, did_you_mean, refuse
from ..studio import offered_motions
from ..values.configurations import Configuration
from ..values.frames import Pose
from ..values.quantities import Quantity
from .dynamics import Dynamics
from .joints import Joint
from .kinematics import Kinematics
from .payload import Payload
from .touching import touching
from .urdf import Interfaces

if TYPE_CHECKING:
    from ..cell.signals import DigitalOutput
    from ..motion.queue import MoveQueue

V = TypeVar("V")

_SENSED = ("standstill", "moving", "stopping")
"""States of a joint in which its verb reads the position."""

TOUCHING_TOLD = 3
"""Maximum number of pairs of bodies that a message lists."""


class Arm(Group[Joint]):
    """The joints of an arm, `arm.elbow`, and its tool: `arm.pose()` returns its pose, `arm.inverse(pose)` the joint positions for a
    pose.

    Poses are in the frame of the model's world, or, with `arm.base`, in the frame in which it places the arm; they are poses of the
    flange (a site `tool` of the model), or of the frame that `arm.tool` defines relative to it. Both are read at each start of a
    verb.
    """

    def __init__(
        self,
        name: str,
        *joints: Joint,
        kinematics: Callable[[], Kinematics],
        notes: tuple[str, ...] = (),
        groups: Mapping[str, tuple[str, ...]] = MappingProxyType({}),
        states: Mapping[str, Mapping[str, float]] = MappingProxyType({}),
        interfaces: Mapping[str, Interfaces] = MappingProxyType({}),
    ) -> None:
        super().__init__(name, *joints)
        self._read = kinematics
        self.notes = notes
        """Corrections made to the arm's file on loading, one sentence each."""
        self.groups = dict(groups)
        """Groups of the arm's SRDF file, each with the names of its joints in the file."""
        self.states = {state: _of_joints(of, joints) for state, of in states.items()}
        """States of the arm's SRDF file: positions of joints in the arm's order, rad or m; a state may omit some joints."""
        self.interfaces = _of_joints(interfaces, joints)
        """Declarations of the arm's joints in the `ros2_control` tags of its URDF file, by name."""
        self._kinematics_of: Callable[[list[str]], Kinematics] | None = None
        """Function that returns the geometry of some of the arm's joints, by their names in the model."""
        self._dynamics_of: Callable[[Kinematics], Dynamics] | None = None
        """Function that reads the masses of the links of a geometry."""
        self._scene: Path | None = None
        """Simulated MJCF model, including the arm's surroundings; None for a real arm."""
        self._payload = Payload(0.0)
        self._carrying: VerbInstance[Any] | None = None

    def part(self, group: str | Sequence[str]) -> Arm:
        """Returns some of the joints as an arm: those of a `group` of its SRDF file, or those with these names, in the arm's order.

        A motion can move at most 16 joints, so a robot with more is moved in parts, `robot.part("left_arm")`, each with its own pose
        and lines. The pose is refused if a joint outside the part moves the tool. Raises `UnknownName` for a group or joint that does
        not exist.
        """
        if isinstance(group, str) and group not in self.groups:
            refuse(
                UnknownName, f"arm '{self.name}' has no group '{group}'", did_you_mean(group, self.groups) or "pass a list of its joints"
            )
        wanted = self.groups[group] if isinstance(group, str) else group
        models = {joint.name.removeprefix(f"{self.name}."): joint for joint in self}
        chosen = [models[name] if name in models else self[name] for name in wanted if name in models or not isinstance(group, str)]
        names = [name for name, joint in models.items() if joint in chosen]
        name = f"{self.name}.{group}" if isinstance(group, str) else f"part of {self.name}"
        of = self._kinematics_of
        joints = [models[name] for name in names]
        part = Arm(
            name, *joints, kinematics=self._read if of is None else lambda: of(names), states=self.states, interfaces=self.interfaces
        )
        part.model, part._kinematics_of, part._dynamics_of = self.model, of, self._dynamics_of
        if isinstance(group, str):
            part._offer()
        return part

    def _offer(self) -> None:
        """Offers motions of the arm's tool in the studio of its system, whether the studio is served now or later."""
        self.system._arms[self.name] = self
        offered_motions.offer_for(self)

    def touching(self) -> list[tuple[str, str]]:
        """Returns pairs of bodies, by their names in the model, that are in contact at the current position of a simulated arm but not
        at its home; empty for other arms.

        Freely moving bodies are excluded. Not on the real-time path: it loads the model.
        """
        return self._touching_at("sensed")

    def _touching_at(self, states: str) -> list[tuple[str, str]]:
        if self._scene is None:
            return []
        names = [joint.name.removeprefix(f"{self.name}.") for joint in self]
        return touching(self._scene, dict(zip(names, self.values(states), strict=True)))

    def _said_of_end(self, message: str) -> str:
        """Returns an addition to the message of a motion's end: the bodies in contact, if a joint did not follow."""
        if "following_error" not in message:
            return ""
        # Report the end even if the file of the model no longer exists.
        with contextlib.suppress(Error, OSError, ValueError):
            if pairs := self.touching()[:TOUCHING_TOLD]:
                return "".join(f"; '{first}' touches '{second}'" for first, second in pairs)
            # An arm that has collided rebounds, and may no longer be in contact.
            pairs = self._touching_at("reference")[:TOUCHING_TOLD]
            return "".join(f"; at its commanded position, '{first}' collides with '{second}'" for first, second in pairs)
        return ""

    @functools.cached_property
    def kinematics(self) -> Kinematics:
        """Geometry of the arm, read from its model on first use."""
        return self._read()

    @functools.cached_property
    def dynamics(self) -> Dynamics:
        """Masses of the arm's links, without its payload, read from its model on first use.

        Raises `DefinitionError` for an arm whose model is unknown here.
        """
        if self._dynamics_of is None:
            refuse(DefinitionError, f"the masses of '{self.name}' are unknown", "load its URDF or MJCF file with the same driver")
        return self._dynamics_of(self.kinematics)

    @property
    def chain(self) -> dict[str, Any]:
        """Geometry as the value of the parameter `chain` of the kinematic blocks."""
        return self.kinematics.chain

    @property
    def standing(self) -> dict[str, Any]:
        """Value of `chain` in the frame of the model's world, regardless of `base`. Used for weights, because their direction is defined
        in that frame."""
        return {**self.chain, "base": list(Pose())}

    @property
    def tool(self) -> Pose:
        """Frame of the tool relative to the flange. It can be set to a pose, or to seven numbers."""
        return self.kinematics.tool

    @tool.setter
    def tool(self, frame: Pose | Sequence[float]) -> None:
        self.kinematics.tool = Pose.of(frame)
        offered_motions.offer_for(self)

    @property
    def base(self) -> Pose:
        """Frame of the model's world relative to the frame of poses. It can be set to a pose, or to seven numbers."""
        return self.kinematics.base

    @base.setter
    def base(self, frame: Pose | Sequence[float]) -> None:
        self.kinematics.base = Pose.of(frame)
        offered_motions.offer_for(self)

    @property
    def payload(self) -> Payload:
        """Payload of the arm, whose weight its joints hold while it is enabled. It can be set at any time; `Payload(0)` removes it.

        Only for loads unknown to the physical device: the holding effort reported by a MuJoCo arm or a drive already includes the
        bodies of its model, including a tool.
        """
        return self._payload

    @payload.setter
    def payload(self, payload: Payload) -> None:
        if self._carrying is not None and self._carrying.state == "running":
            self._carrying.set(mass=payload.mass, centre=list(payload.centre))
        elif payload.mass != 0 and all(joint.state in ("standstill", "moving") for joint in self):
            self._carry(payload)
        self._payload = payload

    def enable(self, timeout: Quantity | None = "10 s") -> Self:
        """Enables all joints, and holds the payload, if there is one; returns when all are ready. `timeout` is as in `Group.enable`."""
        super().enable(timeout)
        if self._payload.mass != 0 and not (self._carrying is not None and self._carrying.state == "running"):
            self._carry(self._payload)
        return self

    def _carry(self, payload: Payload) -> None:
        from ..motion.payload import carry

        if self._carrying is not None and self._carrying.state != "deleted":
            self._carrying.delete()
        self._carrying = carry.new_instance(self)
        self._carrying.start(payload.mass, payload.centre)

    def queue(self, *, outputs: Sequence[DigitalOutput] = (), tolerance: float = 0.002, rate: float = 1.0) -> MoveQueue:
        """Returns a queue of moves, for a `with` statement: moves are appended while earlier ones run, and blend into each other.

        outputs: digital outputs that moves may switch at points on the path; tolerance of each joint at the end: rad; rate: fraction
        of the programmed speed at the beginning, 0 to wait for `step` or a later `rate`. The arm follows one path through all moves,
        at any speed.
        """
        from ..motion.queue import MoveQueue

        return MoveQueue(self, tolerance, outputs, rate)

    def pose(self) -> Pose:
        """Returns the current pose of the tool, from one consistent snapshot of the sensed joint positions.

        Raises `NotEnabled` if a joint is not enabled, because its position is not read then and it may have been moved.
        """
        return self.forward(self._present("the pose"))

    def _present(self, what: str) -> Any:
        """Returns the current joint positions. Refuses if a joint is not enabled, because its `sensed` value may be outdated."""
        for joint in self:
            state = joint.state
            if state not in _SENSED:
                refuse(
                    NotEnabled,
                    f"cannot compute {what} of arm '{self.name}': joint '{joint.name}' is {state}, "
                    "so its position may have changed since it was last enabled",
                    f"enable it first with {self.name}.enable(), or pass joint positions, for example readings of its channels",
                )
        return self.values("sensed")

    def forward(self, q: Iterable[float]) -> Pose:
        """Returns the pose of the tool at the joint positions `q` (rad or m, one for each joint)."""
        return self.kinematics.forward(q)

    def inverse(
        self,
        pose: Pose | Sequence[float],
        near: Iterable[float] | None = None,
        *,
        configuration: Configuration | str | None = None,
        attempts: int = 20,
    ) -> np.ndarray:
        """Returns joint positions that bring the tool to `pose`, within the joints' ranges, as close as possible to `near` (by default
        the current ones).

        The current positions require enabled joints (`NotEnabled`).

        `configuration` selects one of several solutions: `"+-+"` are the signs of shoulder, elbow and wrist (`arm.configuration()`),
        for arms with a closed-form solution. `Unreachable` gives the distance to the nearest position found, and the joint whose
        range prevents the pose.
        """
        return self.kinematics.inverse(
            pose, self._present("the inverse near the current position") if near is None else near,
            position_min=self.values("position_min"), position_max=self.values("position_max"),
            configuration=configuration, attempts=attempts,
        )  # fmt: skip

    def solutions(self, pose: Pose | Sequence[float]) -> list[np.ndarray]:
        """Returns all joint positions within the ranges that bring the tool to `pose`: one for each configuration, at most eight.

        Requires an arm with a closed-form solution (`configuration`); raises `DefinitionError` for others.
        """
        return self.kinematics.solutions(pose, position_min=self.values("position_min"), position_max=self.values("position_max"))

    def configuration(self, q: Iterable[float] | None = None) -> Configuration:
        """Returns the configuration of the joint positions `q`, by default the current ones: signs of shoulder, elbow and wrist, and
        turns.

        Requires six revolute joints, the second axis parallel to the third and perpendicular to the first, with a spherical wrist or
        the axes of Universal Robots arms. Other arms, including those with seven joints, raise `DefinitionError`: use `near=` for
        them.
        """
        return self.kinematics.configuration(self._present("the configuration") if q is None else q)

    def jacobian(self, q: Iterable[float] | None = None) -> np.ndarray:
        """Returns the geometric Jacobian, 6 x n, at the joint positions `q`, by default the current ones, which requires enabled joints."""
        return self.kinematics.jacobian(self._present("the current Jacobian") if q is None else q)


def _of_joints(of: Mapping[str, V], joints: Sequence[Joint]) -> dict[str, V]:
    """Reorders values, keyed by the joints' names in the file, into the order of the arm's joints."""
    names = (max((name for name in of if joint.name.endswith(f".{name}")), key=len, default=None) for joint in joints)
    return {name: of[name] for name in names if name is not None}
