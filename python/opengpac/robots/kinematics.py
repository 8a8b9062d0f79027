# SPDX-License-Identifier: Apache-2.0
"""Geometry of an arm: the pose and motion of its tool, and the joint positions for a pose.

The library's blocks `forward_kinematics`, `jacobian` and `inverse_kinematics` perform the computation, as on the real-time system;
this module reads the geometry and passes it to them.
"""

from __future__ import annotations

import importlib
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .. import _native
from .. import library as lib
from ..drivers.simulated import mujoco_folder
from ..errors import CallError, DefinitionError, DeviceFailed, UnknownName, Unreachable, did_you_mean, refusals, refuse
from ..refusals.declared_names import DeclaredNames
from ..values.configurations import Configuration
from ..values.frames import Pose
from ..values.numbers import is_number, number, rows
from .closed_forms import ClosedForms, in_turn

JOINTS_MAX = lib.forward_kinematics.items["n"].most
"""Maximum number of joints of a chain."""

NONE, HINGE, SLIDE = 0, 1, 2
"""Kinds of joints: without effect on the tool, revolute, prismatic."""

ROUNDING = 1e-9
"""Tolerance by which a position may exceed a range, rad or m."""

EXACT = 1e-8
"""Position (m) and angle (rad) tolerance of a computed pose."""

_TOOL_SITES = ("tool", "attachment_site")


@dataclass(frozen=True)
class Axis:
    """A joint of a chain: its name, its kind, and its axis of rotation or translation with every joint at 0 (m, in the base frame)."""

    name: str
    kind: int
    direction: tuple[float, float, float] = (0.0, 0.0, 0.0)
    point: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass
class Kinematics(DeclaredNames):
    """A chain of joints as a product of exponentials: the axes, and the flange's pose with every joint at 0.

    `base` is the pose of the arm in the frame of poses, `tool` the tool's frame relative to the flange; both can be set. `chain` is
    the value for the parameter of that name of the kinematic blocks.
    """

    _settable = frozenset({"axes", "home", "base", "tool"})

    axes: Sequence[Axis]
    home: Pose
    base: Pose = field(default_factory=Pose)
    tool: Pose = field(default_factory=Pose)

    def _called(self) -> str:
        return f"the kinematics of {self.joints}"

    @property
    def joints(self) -> list[str]:
        """Names of the joints, including those that do not move the tool."""
        return [axis.name for axis in self.axes]

    @property
    def chain(self) -> dict[str, Any]:
        """Value of the parameter `chain` of the blocks."""
        unused = JOINTS_MAX - len(self.axes)
        nothing = [[0.0] * 3] * unused
        return {
            "joints": len(self.axes), "kind": [a.kind for a in self.axes] + [NONE] * unused,
            "base": list(self.base), "home": list(self.home), "tool": list(self.tool),
            "axis": [list(a.direction) for a in self.axes] + nothing, "anchor": [list(a.point) for a in self.axes] + nothing,
        }  # fmt: skip

    def forward(self, q: Iterable[float]) -> Pose:
        """Returns the pose of the tool at the joint positions `q`, rad or m: one for each joint, or a mapping by joint names, such as a
        taught point."""
        found = lib.block("forward_kinematics").run(n=len(self.axes), chain=self.chain, q=self._positions(q))
        self._check(found.fault)
        return Pose.of(found.pose[0])

    def jacobian(self, q: Iterable[float]) -> np.ndarray:
        """Returns the geometric Jacobian at `q`, 6 x n: linear (m/s) and angular (rad/s) velocity of the tool per unit joint speed."""
        found = lib.block("jacobian").run(n=len(self.axes), chain=self.chain, q=self._positions(q))
        self._check(found.fault)
        return found.jacobian[0].T

    def inverse(
        self,
        pose: Pose | Sequence[float],
        near: Iterable[float],
        *,
        position_min: Iterable[float] | None = None,
        position_max: Iterable[float] | None = None,
        configuration: Configuration | str | None = None,
        attempts: int = 20,
    ) -> np.ndarray:
        """Returns joint positions that place the tool at `pose`, searching from `near`, and within the ranges if they are passed. Raises
        `Unreachable` if none are found.

        The search starts from `near`, keeping the arm's posture if possible, and is then repeated from `attempts` - 1 other
        positions. With a `configuration` the positions are those of the closed-form solution, with its turns, or the ones nearest to
        `near`; raises `DefinitionError` for a chain without a closed form.
        """
        if configuration is not None:
            chosen = Configuration.of(configuration)
            return self._chosen(Pose.of(pose), np.array(self._positions(near)), chosen, position_min, position_max)
        ranges: dict[str, Any] = {}
        if position_min is not None:
            ranges["position_min"] = self._positions(position_min)
        if position_max is not None:
            ranges["position_max"] = self._positions(position_max)
        found = lib.block("inverse_kinematics").run(
            n=len(self.axes), chain=self.chain, goal=list(Pose.of(pose)), near=self._positions(near), attempts=attempts, **ranges
        )
        self._check(found.fault)
        if not found.reached[0]:
            limit = next((int(value) for _, name, value in found.conditions if name == "limit"), None)
            self._unreachable(Pose.of(pose), float(found.position_error[0]), float(found.angle_error[0]), limit, ranges)
        return found.q[0]

    def solutions(
        self,
        pose: Pose | Sequence[float],
        *,
        position_min: Iterable[float] | None = None,
        position_max: Iterable[float] | None = None,
    ) -> list[np.ndarray]:
        """Returns all joint positions that place the tool at `pose`, at most eight, each joint in the turn of its range that is nearest
        to 0.

        Uses the closed-form solution (see `configuration`); if the wrist is straight in a solution, its last joint is arbitrary and
        is set to 0.
        """
        middle = np.zeros(len(self.axes))
        found = [self._in_range(q, middle, position_min, position_max) for q in self._closed().all(Pose.of(pose), middle)]
        return [self._polished(Pose.of(pose), q) for q in found if isinstance(q, np.ndarray)]

    def configuration(self, q: Iterable[float]) -> Configuration:
        """Returns the configuration of the joint positions `q`.

        Requires six revolute joints, the first perpendicular to the second, the second parallel to the third, with a spherical wrist
        or the axes of Universal Robots arms; raises `DefinitionError` for other chains.
        """
        return self._closed().configuration(np.array(self._positions(q)))

    @property
    def has_configurations(self) -> bool:
        """True for a chain with a closed-form solution, the only kind with configurations."""
        return ClosedForms.of(self) is not None

    def _closed(self) -> ClosedForms:
        forms = ClosedForms.of(self)
        if forms is None:
            refuse(
                DefinitionError,
                f"the chain of {self.joints} has no inverse in closed form and therefore no configurations",
                "select the solution by joint positions, near=; only arms of six joints with a spherical wrist, or "
                "like those of Universal Robots, have configurations",
            )
        return forms

    def _chosen(
        self, pose: Pose, near: np.ndarray, of: Configuration, low: Iterable[float] | None, high: Iterable[float] | None
    ) -> np.ndarray:
        forms = self._closed()
        if of.turns and len(of.turns) != len(forms.joints):
            refuse(
                CallError,
                f"a configuration must have one turn for each of its {len(forms.joints)} joints, not {len(of.turns)}",
                "pass one for each joint",
            )
        found = {forms.configuration(q).signs: q for q in forms.all(pose, near)}
        if of.signs not in found:
            others = ", ".join(f"'{signs}'" for signs in sorted(found))
            remedy = f"choose one that reaches it: {others}" if found else "choose a pose nearer to the arm"
            refuse(Unreachable, f"{pose} is out of reach in the configuration '{of.signs}'", remedy)
        q = found[of.signs]
        if of.turns:
            for j, turn in zip(forms.joints, of.turns, strict=True):
                q[j] = in_turn(q[j], turn, near[j])
            wrong = self._outside(q, low, high)
        else:
            placed = self._in_range(q, near, low, high)
            if not isinstance(placed, int):
                return self._polished(pose, placed)
            wrong = placed
        if wrong is not None:
            refuse(
                Unreachable,
                f"{pose} in the configuration '{of.signs}' needs joint '{self.axes[wrong].name}' at {q[wrong]:.4g}, outside its range",
                "choose another configuration, or other turns",
            )
        return self._polished(pose, q)

    def _in_range(self, q: np.ndarray, near: np.ndarray, low: Iterable[float] | None, high: Iterable[float] | None) -> np.ndarray | int:
        """Returns the positions with each revolute joint in the turn within its range that is nearest to `near`, or the index of the
        first joint that has no such turn."""
        q = q.copy()
        least = np.full(len(q), -np.inf) if low is None else np.array(self._positions(low))
        most = np.full(len(q), np.inf) if high is None else np.array(self._positions(high))
        for j, axis in enumerate(self.axes):
            if axis.kind != HINGE:
                continue
            turned = q[j] + 2 * np.pi * (np.round((near[j] - q[j]) / (2 * np.pi)) + np.array([0.0, 1.0, -1.0, 2.0, -2.0]))
            inside = turned[(turned >= least[j] - ROUNDING) & (turned <= most[j] + ROUNDING)]
            if not len(inside):
                return j
            q[j] = min(max(inside[np.abs(inside - near[j]).argmin()], least[j]), most[j])
        return q

    def _outside(self, q: np.ndarray, low: Iterable[float] | None, high: Iterable[float] | None) -> int | None:
        """Returns the first joint outside its range, or None."""
        least = np.full(len(q), -np.inf) if low is None else np.array(self._positions(low))
        most = np.full(len(q), np.inf) if high is None else np.array(self._positions(high))
        return next((j for j in range(len(q)) if not least[j] - ROUNDING <= q[j] <= most[j] + ROUNDING), None)

    def _polished(self, pose: Pose, q: np.ndarray) -> np.ndarray:
        """Refines the positions, for a model whose axes are not exactly parallel or do not exactly intersect."""
        reached = self.forward(q)
        return q if reached.distance(pose) < EXACT and reached.angle(pose) < EXACT else self.inverse(pose, q, attempts=1)

    def _unreachable(self, pose: Pose, position: float, angle: float, limit: int | None, ranges: Mapping[str, Any]) -> None:
        far = f"the nearest solution is {position:.4g} m away and turned by {np.degrees(angle):.4g} degrees"
        if limit is None:
            refuse(Unreachable, f"{pose} is out of reach: {far}", "choose a pose nearer to the arm, or start from another posture: near=")
        low, high = (ranges.get(name, [float("nan")] * len(self.axes))[limit] for name in ("position_min", "position_max"))
        range_text = f"the range of joint '{self.axes[limit].name}', {low:.6g} to {high:.6g}"
        refuse(Unreachable, f"{pose} cannot be reached within {range_text}: {far}", "start from another posture: near=")

    def _positions(self, given: Iterable[float]) -> list[float]:
        if not 1 <= len(self.axes) <= JOINTS_MAX:
            refuse(DefinitionError, f"a chain cannot have {len(self.axes)} joints", f"use 1 to {JOINTS_MAX} axes")
        listed = self._in_order(given) if isinstance(given, Mapping) else rows(given)
        found: list[Any] = [number(x) for x in listed] if isinstance(listed, Iterable) and not isinstance(listed, str | bytes) else [listed]
        if not all(is_number(x) for x in found):
            refuse(CallError, f"{repr(given)[:80]} is not a list of joint positions", "pass a number for each joint, rad or m")
        if len(found) != len(self.axes):
            refuse(CallError, f"the chain needs {len(self.axes)} joint positions, not {len(found)}", f"pass one for each of {self.joints}")
        return found

    def _in_order(self, given: Mapping[Any, Any]) -> list[Any]:
        """Returns joint positions given by name, for example those of a taught point, in the order of the chain; ignores other joints."""
        found: list[Any] = []
        for joint in self.joints:
            position = next((value for name, value in given.items() if joint == name or joint.endswith(f".{name}")), None)
            if position is None:
                there = ", ".join(map(str, given)) or "none"
                refuse(CallError, f"the joint positions lack joint '{joint}'; they have {there}", "pass a number for each joint, rad or m")
            found.append(position)
        return found

    def _check(self, fault: Any) -> None:
        if fault is not None:
            refuse(
                DefinitionError, f"the chain of {self.joints} cannot be used: {fault}", "make its axes unit vectors and its frames poses"
            )

    @classmethod
    def of_mjcf(cls, path: str | os.PathLike[str], joints: Sequence[str], *, site: str | None = None) -> Kinematics:
        """Returns the geometry of an MJCF arm from its world to its tool, read from `path` through MuJoCo. `joints` are the actuated
        joints, in order.

        The tool is the site called `site`; by default the site that most of these joints move: `tool` or `attachment_site`, also with
        a prefix (`left_tool`), otherwise the site of a force sensor, otherwise the body of the last joint. Raises `CallError` if
        `joints` is empty or contains duplicates, `UnknownName` for a joint or a site that the model lacks.
        """
        names = _names(joints)
        try:
            mujoco = importlib.import_module("mujoco")
        except ImportError:
            refuse(DeviceFailed, "the Python package 'mujoco' is not installed", "run pip install 'opengpac[mujoco]'")
        with refusals:
            problem = _native.try_driver("mujoco", json.dumps({"path": os.fspath(path), "library": mujoco_folder()}))
        if problem is not None:
            refuse(DeviceFailed, problem)
        return _read(mujoco, mujoco.MjModel.from_xml_path(os.fspath(path)), names, site)

    def __repr__(self) -> str:
        kinds = {NONE: "does not move the tool", HINGE: "turns", SLIDE: "slides"}
        lines = [f"\n  {a.name} {kinds[a.kind]}" for a in self.axes]
        return f"kinematics: base {self.base!r}, flange at zero {self.home!r}, tool {self.tool!r}{''.join(lines)}"


def _names(joints: Any) -> list[str]:
    """Checks that the joint names passed to a call include at least one and no duplicates, and returns them."""
    listed = rows(joints)
    names = [] if isinstance(listed, str) or not isinstance(listed, Iterable) else list(listed)
    if not all(isinstance(name, str) for name in names) or (not names and listed not in ([], ())):
        refuse(
            CallError, f"the joints of a chain must be a list of names, not {repr(joints)[:80]}", "pass ['shoulder', 'elbow'], for example"
        )
    if not names:
        refuse(CallError, "a chain needs at least one joint", "name the driven joints in order")
    twice = next((name for index, name in enumerate(names) if name in names[:index]), None)
    if twice is not None:
        refuse(CallError, f"joint '{twice}' occurs twice in the chain", "name each joint once")
    return names


def _read(mujoco: Any, model: Any, names: list[str], named: str | None) -> Kinematics:
    known = joint_numbers(model)
    for name in names:
        if name not in known:
            refuse(UnknownName, f"the model has no joint '{name}'", did_you_mean(str(name), known))
    sites = [model.site(s).name for s in range(model.nsite)]
    if named is not None and named not in sites:
        refuse(UnknownName, f"the model has no site '{named}'", did_you_mean(named, sites))
    ids = [known[name] for name in names]
    data = at_zero(mujoco, model, ids)
    body, home = _flange(mujoco, model, data, ids, named)
    on_the_way = joints_before(model, body)
    for j in on_the_way - set(ids):
        name = model.joint(j).name or f"joint_{j}"
        refuse(DefinitionError, f"joint '{name}' moves the tool but is not driven", "add an actuator, or weld the joint in the model")
    slide = int(mujoco.mjtJoint.mjJNT_SLIDE)
    axes = [
        Axis(name, SLIDE if model.jnt_type[j] == slide else HINGE, tuple(data.xaxis[j].tolist()), tuple(data.xanchor[j].tolist()))
        if j in on_the_way
        else Axis(name, NONE)
        for name, j in zip(names, ids, strict=True)
    ]
    return Kinematics(axes, home)


def joint_numbers(model: Any) -> dict[str, int]:
    """Returns the indices of a model's joints by name; a joint without a name is called `joint_N`."""
    return {model.joint(j).name or f"joint_{j}": j for j in range(model.njnt)}


def at_zero(mujoco: Any, model: Any, joints: Iterable[int]) -> Any:
    """Returns the data of a model with these joints at 0 and the others at their reference positions."""
    data = mujoco.MjData(model)
    for j in joints:
        data.qpos[model.jnt_qposadr[j]] = 0.0
    mujoco.mj_kinematics(model, data)
    return data


def joints_before(model: Any, body: int) -> set[int]:
    """Returns the joints that move a body."""
    found: set[int] = set()
    while body:
        first = model.body_jntadr[body]
        found.update(range(first, first + model.body_jntnum[body]))
        body = int(model.body_parentid[body])
    return found


def _flange(mujoco: Any, model: Any, data: Any, ids: list[int], named: str | None) -> tuple[int, Pose]:
    """Returns the body of the tool, and the pose of the flange."""
    site = _tool_site(mujoco, model, ids, named)
    if site is not None:
        turn = np.zeros(4)
        mujoco.mju_mat2Quat(turn, data.site_xmat[site])
        return int(model.site_bodyid[site]), Pose(data.site_xpos[site], quaternion=turn)
    body = int(model.jnt_bodyid[ids[-1]])
    return body, Pose(data.xpos[body], quaternion=data.xquat[body])


def _tool_site(mujoco: Any, model: Any, ids: list[int], named: str | None) -> int | None:
    """Returns the candidate tool site that is moved by the most of these joints; in a world with several arms, each arm has its own."""
    forces = [int(model.sensor_objid[s]) for s in range(model.nsensor) if model.sensor_type[s] == int(mujoco.mjtSensor.mjSENS_FORCE)]
    names = [model.site(s).name for s in range(model.nsite)]

    def rank(site: int) -> int | None:
        """Returns the rank of a site as a candidate for the tool, lowest being best; None if it is not a candidate."""
        if named is not None:
            return 0 if names[site] == named else None
        if names[site] in _TOOL_SITES:
            return _TOOL_SITES.index(names[site])
        if names[site].endswith(_TOOL_SITES):
            return len(_TOOL_SITES)
        return len(_TOOL_SITES) + 1 if site in forces else None

    def moved(site: int) -> int:
        return len(joints_before(model, int(model.site_bodyid[site])) & set(ids))

    def is_of_another(site: int) -> bool:
        """Returns whether a site is the tool of another arm on the same trunk: other joints move it too, but not all of these joints do."""
        return moved(site) < deepest and bool(joints_before(model, int(model.site_bodyid[site])) - set(ids))

    deepest = max(len(joints_before(model, int(model.jnt_bodyid[j])) & set(ids)) for j in ids)
    ranked = [
        (-moved(site), of, site)
        for site in range(model.nsite)
        if (of := rank(site)) is not None and not (named is None and is_of_another(site))
    ]
    least = min(ranked, default=None)
    return None if least is None or least[0] == 0 else least[2]
