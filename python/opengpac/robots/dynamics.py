# SPDX-License-Identifier: Apache-2.0
"""Masses of an arm, and the joint efforts required by its motions.

The library's block `inverse_dynamics` computes the efforts, here as on the real-time system; this module reads the masses from the
model and passes them to the block.
"""

from __future__ import annotations

import dataclasses
import importlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import library as lib
from ..errors import CallError, DefinitionError, refuse
from ..values.frames import Pose
from .inertias import matrix_of, six_of
from .kinematics import JOINTS_MAX, NONE, Kinematics, at_zero, joint_numbers, joints_before
from .payload import Payload

GRAVITY = (0.0, 0.0, -9.81)
"""Gravity if the model does not define it, m/s²."""


@dataclass(frozen=True)
class Link:
    """Masses that move with a joint, combined into one rigid body, in the frame of the arm's base with every joint at 0.

    `mass` is in kg, `centre` the centre of mass in m, `inertia` about that centre in kg m², as xx, yy, zz, xy, xz, yz. `armature` is
    the inertia of the joint's motor, reflected to the joint, in kg m², or kg for a prismatic joint.
    """

    mass: float = 0.0
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)
    inertia: tuple[float, float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    armature: float = 0.0

    def joined(self, other: Link) -> Link:
        """Combines both links into one rigid body, with the armature of this one.
        >>> Link(1.0, (0.0, 0.0, 0.0)).joined(Link(1.0, (2.0, 0.0, 0.0))).centre
        (1.0, 0.0, 0.0)
        """
        mass = self.mass + other.mass
        if mass == 0.0:
            return self
        centre = (self.mass * np.array(self.centre) + other.mass * np.array(other.centre)) / mass
        inertia = np.zeros(6)
        for link in (self, other):
            x, y, z = np.array(link.centre) - centre
            offset = [y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z]
            inertia += np.array(link.inertia) + link.mass * np.array(offset)
        xx, yy, zz, xy, xz, yz = inertia.tolist()
        return Link(mass, three(centre), (xx, yy, zz, xy, xz, yz), self.armature)


@dataclass(frozen=True)
class Dynamics:
    """A chain of joints with the masses of its links: `arm.dynamics`, or `Dynamics.of_mjcf(path, joints)`.

    `links` has one link for each joint of `kinematics`: the bodies that move with it but not with the next one. Parts attached to
    joints that do not move the tool, such as fingers, are treated as rigid, with these joints at 0. `gravity` is in m/s², in the
    frame of the model's world. Friction and damping of the joints are not modelled.
    """

    kinematics: Kinematics
    links: tuple[Link, ...]
    gravity: tuple[float, float, float] = GRAVITY

    @property
    def parameters(self) -> dict[str, Any]:
        """Values of the parameters `chain`, `links` and `gravity` of the block `inverse_dynamics`."""
        unused = JOINTS_MAX - len(self.links)
        links = [*self.links, *[Link()] * unused]
        return {
            "chain": {**self.kinematics.chain, "base": list(Pose())},
            "links": {name: [getattr(link, name) for link in links] for name in ("mass", "centre", "inertia", "armature")},
            "gravity": list(self.gravity),
        }

    def effort(
        self, q: Iterable[float], velocity: Iterable[float] | None = None, acceleration: Iterable[float] | None = None
    ) -> np.ndarray:
        """Returns the effort of each joint, N.m or N, for a motion at positions `q`, rad or m; `velocity` and `acceleration` default to
        0.

        Raises `CallError` unless there is a number for each joint.
        """
        positions = self.kinematics._positions
        given = {"velocity": velocity, "acceleration": acceleration}
        return self._run(q=positions(q), **{name: positions(value) for name, value in given.items() if value is not None})[0]

    def effort_of_each(self, q: np.ndarray, velocity: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
        """Returns the efforts of many samples, a row for each, like `effort`; the arguments have a row for each sample."""
        return self._run(q=q.tolist(), velocity=velocity.tolist(), acceleration=acceleration.tolist())

    def inertia(self, q: Iterable[float]) -> np.ndarray:
        """Returns the inertia matrix of the joints, n x n, at positions `q` (rad or m): effort = inertia @ acceleration, without gravity.

        Raises `CallError` unless there is a number for each joint.
        """
        n = len(self.links)
        weightless = dataclasses.replace(self, gravity=(0.0, 0.0, 0.0))
        return weightless._run(q=[self.kinematics._positions(q)] * n, acceleration=np.eye(n).tolist()).T

    def carrying(self, payload: Payload) -> Dynamics:
        """Returns the dynamics of the arm with a payload at its flange: a body with the payload's mass, centre and inertia."""
        moving = [i for i, axis in enumerate(self.kinematics.axes) if axis.kind != NONE]
        if not moving:
            refuse(
                DefinitionError,
                f"no joint of {self.kinematics.joints} moves the flange, which carries the payload",
                "omit the payload",
            )
        at = self.kinematics.home @ Pose(payload.centre)
        turn = at.matrix[:3, :3]
        about = six_of(turn @ matrix_of(payload.inertia) @ turn.T)
        links = list(self.links)
        links[moving[-1]] = links[moving[-1]].joined(Link(payload.mass, three(at.position), about))
        return dataclasses.replace(self, links=tuple(links))

    def _run(self, **inputs: Any) -> np.ndarray:
        found = lib.block("inverse_dynamics").run(n=len(self.links), **self.parameters, **inputs)
        if found.fault is not None:
            refuse(CallError, f"the efforts of {self.kinematics.joints} cannot be computed: {found.fault}", "pass finite numbers")
        return found.effort

    @classmethod
    def of_mjcf(cls, path: Any, joints: Sequence[str], *, site: str | None = None, kinematics: Kinematics | None = None) -> Dynamics:
        """Reads the dynamics of an MJCF arm through MuJoCo. `joints` are the actuated joints, in order; `site` is the flange.

        `kinematics` is the geometry of these joints, if it is already known; otherwise it is read as by `Kinematics.of_mjcf`, with
        the same errors.
        """
        chain = Kinematics.of_mjcf(path, joints, site=site) if kinematics is None else kinematics
        mujoco = importlib.import_module("mujoco")
        model = mujoco.MjModel.from_xml_path(str(path))
        return cls(chain, _links(mujoco, model, chain), three(model.opt.gravity))


def three(given: Iterable[float]) -> tuple[float, float, float]:
    """Returns three numbers as a tuple of plain numbers."""
    x, y, z = (float(each) for each in given)
    return x, y, z


def _links(mujoco: Any, model: Any, chain: Kinematics) -> tuple[Link, ...]:
    """Returns a link for each joint of a chain, combining the bodies that this joint moves but the next one does not."""
    known = joint_numbers(model)
    ids = {known[axis.name]: i for i, axis in enumerate(chain.axes) if axis.kind != NONE}
    data = at_zero(mujoco, model, (known[name] for name in chain.joints))
    links = [Link(armature=float(model.dof_armature[model.jnt_dofadr[known[axis.name]]])) for axis in chain.axes]
    for body in range(1, model.nbody):
        # MuJoCo numbers joints outward from the base.
        moving = joints_before(model, body) & ids.keys()
        if moving:
            last = ids[max(moving)]
            links[last] = links[last].joined(_body(model, data, body))
    return tuple(links)


def _body(model: Any, data: Any, body: int) -> Link:
    """Returns the mass of a body at the current position of the model, in the world frame."""
    axes = data.ximat[body].reshape(3, 3)
    inertia = axes @ np.diag(model.body_inertia[body]) @ axes.T
    return Link(float(model.body_mass[body]), three(data.xipos[body]), six_of(inertia))
