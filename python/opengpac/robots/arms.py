# SPDX-License-Identifier: Apache-2.0
"""Loading an arm: a physical device, and a logical device for each of its joints."""

from __future__ import annotations

import hashlib
import os
import tempfile
from pathlib import Path

from .. import drivers, files
from ..errors import PlacementError, UnknownName, did_you_mean, refuse
from ..given import taking
from ..physical import Part, PhysicalDevice
from ..sources import Processor, Source
from ..system import System
from .arm import Arm
from .assembly import assemble, joint_names
from .joints import Joint
from .kinematics import Kinematics

_ARMS = Path(__file__).parent

_Model = str | os.PathLike[str] | None


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
) -> Arm:
    """An arm as a group of joints with the geometry that joins them, simulated by MuJoCo, at its keyframe `home` if it has one.

    `path` is an MJCF file, or the name of an arm that comes with the package. `tool` is one that is screwed to its flange
    (`"two_finger"`: see `robots.gripper`), `scene` one of what stands around it; the group has the arm's own joints only. `on` is the
    timer that exchanges with it and runs the servos, else the fastest of `rtp`. `arbitration` says what happens to a second motion
    while one runs: `"refuse"` (`SecondWriter`), `"queue"` (it waits its turn) or `"abort"` (it takes over, smoothly). Without `rtp`
    it makes a system of its own, of the arm's name, with `clock`. `apart` simulates it in a process of its own
    (`gpac.drivers.plant_process`), which a text names for programs that come later. The physical device is
    `system.physical_devices[NAME]`; the joints are `NAME.JOINT`.
    """
    file = _file(path)
    name = name or file.stem
    if on is not None:
        rtp = on.processor
    if rtp is None:
        rtp = System(name, clock=clock).processor("rtp0")
        rtp.timer("slow", period="20 ms", priority=60)
        on = rtp.timer("fast", period="1 ms", priority=80)
    device = _device(rtp, name, file, (tool, scene), on or _fastest(rtp), apart)
    known = device.parts if tool is None and scene is None else joint_names(file)
    own = [part for part in device.parts if part in known]
    joints: list[Joint] = []
    try:
        for part in device:
            if part.name in own:
                joints.append(_joint(name, part, device.source, arbitration))
        arm = Arm(name, *joints, kinematics=lambda: Kinematics.of_mjcf(file, own))
        arm.model = "file:" + hashlib.sha256(file.read_bytes()).hexdigest()[:32]
        return arm
    except BaseException:
        for joint in joints:
            joint.delete()
        device.delete()
        raise


def _device(rtp: Processor, name: str, arm: Path, around: tuple[_Model, _Model], on: Source, apart: bool | str) -> PhysicalDevice:
    """The machine, from one file or from one that is put together."""

    def simulated(model: Path) -> PhysicalDevice:
        driver = drivers.mujoco(model)
        if apart:
            driver = drivers.plant_process(driver, name=apart if isinstance(apart, str) else None)
        return rtp.physical_device(name, driver, exchange=on)

    tool, scene = around
    if tool is None and scene is None:
        return simulated(arm)
    with tempfile.TemporaryDirectory() as folder:
        whole = Path(folder) / f"{arm.stem}.xml"
        whole.write_text(assemble(arm, None if tool is None else _file(tool), None if scene is None else _file(scene)))
        return simulated(whole)


def _joint(arm: str, part: Part, source: Source, arbitration: str) -> Joint:
    about = part.about
    described = {
        "home": about["home"],
        "position_min": about["range_min"],
        "position_max": about["range_max"],
        "max_effort": about["effort_max"],
    }
    gains = {name: about["servo"][name] for name in ("kp", "kd")}
    units = {"N.m": "N", "rad": "m"} if about["unit"] == "m" else None
    return Joint(f"{arm}.{part.name}", drive=part, on=source, units=units, arbitration=arbitration, **described, **gains)


def _file(path: str | os.PathLike[str]) -> Path:
    known = {p.stem: p for p in _ARMS.glob("*.xml")}
    if str(path) in known:
        return known[str(path)]
    file = Path(path).expanduser()
    if not file.suffix and not files.there(file):
        refuse(UnknownName, f"there is no arm '{path}'", did_you_mean(str(path), known) or "give the path of an MJCF file")
    return file.absolute()


def _fastest(rtp: Processor) -> Source:
    timers = [s for s in rtp.system.sources.values() if s.processor is rtp and s.kind == "timer"]
    if not timers:
        refuse(PlacementError, f"processor '{rtp.name}' has no timer for an arm", "make one: rtp.timer('fast', period='1 ms', priority=80)")
    return min(timers, key=lambda source: source.period)
