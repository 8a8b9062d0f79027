# SPDX-License-Identifier: Apache-2.0
"""Emulated Universal Robots controller: RTDE, dashboard and program ports, with an arm of simple joints behind them."""

from __future__ import annotations

import errno
import itertools
import os
import queue
import selectors
import socket
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Self

from ...errors import CallError, DeviceFailed, refuse
from ..driver import Driver
from ..ur import ur as ur_driver
from .arm import CYCLE, HOME, JointArm, RefusedCommand, motions
from .dynamics import SimulatedArm, model_of
from .gripper import Gripper
from .ur_ports import DASHBOARD, RTDE, SCRIPTS, Dashboard, Peer, Rtde, Scripts
from .urscript import Program, ScriptError

_number = itertools.count()

LEAP_MAX = 0.05
"""Maximum distance between consecutive goals, rad; a larger distance causes a protective stop."""

NORMAL, PROTECTIVE, EMERGENCY = 1, 3, 7
POWER_OFF, RUNNING = 3, 7
STOPPED, PLAYING, PAUSED = 1, 2, 4


class ur:
    """An emulated controller at a loopback address of this host, for tests: `with gpac.drivers.fake.ur() as robot: robot.driver()`.

    Its program port runs the programs sent to it; its arm reaches each goal one cycle later. With `lockstep` (the default) one cycle
    elapses with each package received over RTDE, so that results do not depend on the speed of this machine; without it, 500 cycles
    elapse per second. It listens on the ports of a real controller. A goal more than `leap_max` (rad) from the previous one causes a
    protective stop.

    By default, its joints follow their goals exactly. With `model`, `"ur5e"` or an MJCF file, MuJoCo simulates the arm with the
    control loops of a controller; `tool` is attached to its flange and `scene` surrounds it, as for `gpac.robots.load`. With a model,
    the force at the arm's tool is the contact force, and the fingers of the tool are its `gripper`, a separate device:
    `robot.gripper.driver()`.
    """

    def __init__(
        self,
        position: Sequence[float] = HOME,
        *,
        lockstep: bool = True,
        leap_max: float = LEAP_MAX,
        host: str | None = None,
        is_on: bool = True,
        model: str | os.PathLike[str] | None = None,
        tool: str | os.PathLike[str] | None = None,
        scene: str | os.PathLike[str] | None = None,
    ) -> None:
        if len(position) != 6:
            refuse(CallError, f"an arm with 6 joints cannot have {len(position)} joint positions", "pass six numbers in rad")
        self.lockstep = lockstep
        for kind, given in (("scene", scene), ("tool", tool)):
            if model is None and given is not None:
                refuse(CallError, f"{kind} '{given}' requires a model", "pass both: model='ur5e'")
        self.arm = (
            JointArm(position, leap_max)
            if model is None
            else SimulatedArm(
                position, leap_max, model_of(model), None if tool is None else model_of(tool), None if scene is None else Path(scene)
            )
        )
        self.is_remote = True
        self.safety, self.mode, self.runtime = NORMAL, RUNNING if is_on else POWER_OFF, STOPPED
        self.speed_scaling = 1.0
        self.force = [0.0] * 6
        self.digital_inputs = 0
        self.digital_outputs = 0
        self.inputs: dict[str, Any] = {}
        self.registers: dict[str, Any] = {}
        self.log: list[str] = []
        self.cycles = 0
        self._program: Program | None = None
        self._orders: queue.Queue[tuple[Callable[[], Any], queue.Queue[Any]]] = queue.Queue()
        self._selector = selectors.DefaultSelector()
        self._woken, self._wakes = socket.socketpair()
        self._selector.register(self._woken, selectors.EVENT_READ)
        self._listeners: list[socket.socket] = []
        self.peers: list[Peer] = []
        self._ends = False
        self.host = self._listen_anywhere() if host is None else self._listen(host)
        self._thread = threading.Thread(target=self._serve, name="fake ur", daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def driver(self, **options: Any) -> Driver:
        """Returns the driver for this controller."""
        return ur_driver(self.host, **options)

    @property
    def position(self) -> list[float]:
        """Positions of the arm's joints, rad."""
        return self.do(lambda: [*self.arm.q])

    @property
    def step_max(self) -> float:
        """Maximum step of a goal between two cycles so far, rad."""
        return self.do(lambda: self.arm.step_max)

    @property
    def gripper(self) -> Gripper:
        """Gripper at the arm's tool. Raises `CallError` if the arm has no gripper."""
        found = self.arm.gripper if isinstance(self.arm, SimulatedArm) else None
        if found is None:
            refuse(CallError, "this emulated controller has no gripper", "add one: fake.ur(model='ur5e', tool='two_finger')")
        return found

    def sensor(self, name: str) -> list[float]:
        """Returns the reading of the model's sensor `name`, in MuJoCo's units, for example the position of an object in the scene.
        Raises `CallError` if the sensor does not exist."""
        arm = self.arm
        if not isinstance(arm, SimulatedArm):
            refuse(CallError, f"this emulated arm has no model, and therefore no sensor '{name}'", "pass a model: fake.ur(model='ur5e')")
        at = arm.sensor(name)
        return self.do(lambda: arm.reading(at))

    @property
    def program(self) -> str | None:
        """Name of the running program, or None."""
        return self.do(lambda: None if self._program is None else self._program.name)

    def protective_stop(self) -> None:
        """Causes a protective stop, as a collision would."""
        self.do(lambda: self.stop_by(PROTECTIVE))

    def emergency_stop(self) -> None:
        """Causes an emergency stop, as if its button were pressed; recover with `release` and `power_on`."""
        self.do(lambda: self.stop_by(EMERGENCY, POWER_OFF))

    def release(self) -> None:
        """Releases a protective or an emergency stop, as on the teach pendant."""
        self.do(self.unlock)

    def power_on(self) -> None:
        """Powers the arm on and releases its brakes."""
        self.do(self.switch_on)

    def stop_program(self) -> None:
        """Stops the program, as on the teach pendant."""
        self.do(self.end_program)

    def pause_program(self) -> None:
        """Pauses the program, as on the teach pendant; the arm comes to rest."""

        def pause() -> None:
            if self._program is not None:
                self.runtime = PAUSED
                self.arm.rest()

        self.do(pause)

    def press(self, force: Sequence[float]) -> None:
        """Applies a `force` (N) and, with six numbers, a torque (N.m) to the arm's tool, in the base frame."""
        self.do(lambda: setattr(self, "force", [*map(float, force), 0.0, 0.0, 0.0][:6]))

    def set_input(self, number: int, level: bool) -> None:
        """Sets a digital input of the control box."""

        def store() -> None:
            self.digital_inputs = self.digital_inputs & ~(1 << number) | int(level) << number

        self.do(store)

    def output(self, number: int) -> bool:
        """Returns the state of a digital output of the control box."""
        return self.do(lambda: bool(self.digital_outputs >> number & 1))

    def off(self) -> None:
        """Switches the controller off, as a power failure would: connections are reset, and requests remain unanswered."""

        def off() -> None:
            self.stop_by(NORMAL)
            for peer in [*self.peers]:
                self._drop(peer)
            for listener in self._listeners:
                self._selector.unregister(listener)
                listener.close()
            self._listeners, self.inputs, self.registers = [], {}, {}

        self.do(off)

    def on(self, *, powered: bool = True) -> None:
        """Switches the controller on, with the arm at its previous position, and powered on if `powered`."""

        def on() -> None:
            self.mode = RUNNING if powered else POWER_OFF
            self._listen(self.host)

        self.do(on)

    def close(self) -> None:
        """Closes the emulated controller."""
        if not self._ends:
            self._ends = True
            self._wakes.send(b"\0")
            self._thread.join()
            # The thread may end before it is woken: it leaves this pair open.
            self._woken.close()
            self._wakes.close()
            if isinstance(self.arm, SimulatedArm):
                self.arm.close()

    def do(self, order: Callable[[], Any]) -> Any:
        """Calls `order` between two cycles, and returns its result."""
        answer: queue.Queue[Any] = queue.Queue()
        self._orders.put((order, answer))
        self._wakes.send(b"\0")
        return answer.get(timeout=60)

    # The following methods run on the controller's thread.

    def stop_by(self, safety: int, mode: int | None = None) -> None:
        """Stops the arm as the safety system would."""
        self.safety = safety
        self.mode = self.mode if mode is None else mode
        self.end_program()

    def unlock(self) -> None:
        """Releases the safety stop."""
        self.safety = NORMAL

    def switch_on(self) -> None:
        """Powers the arm on and releases the brakes."""
        if self.safety == NORMAL:
            self.mode = RUNNING

    def end_program(self) -> None:
        """Ends the program and holds the arm."""
        self._program, self.runtime = None, STOPPED
        self.arm.rest()

    def begin_program(self, text: str) -> None:
        """Starts a program in place of the running one. An invalid program is refused silently, as on a real controller; the reason is
        logged."""
        if not self.is_remote or self.safety != NORMAL or self.mode != RUNNING:
            self.log.append("a program was refused: the arm is not ready or not in remote control")
            return
        self.end_program()
        try:
            self._program = Program(text, self._functions(), motions(self.arm))
            self.runtime = PLAYING
        except ScriptError as why:
            self.log.append(str(why))

    def cycle(self) -> None:
        """Runs one controller cycle: program, arm, RTDE packages."""
        self.cycles += 1
        if self._program is not None and self.runtime == PLAYING:
            try:
                if not self._program.step():
                    self.end_program()
            except RefusedCommand as why:
                self.log.append(str(why))
                self.stop_by(PROTECTIVE)
            except ScriptError as why:
                self.log.append(str(why))
                if isinstance(why.__cause__, RefusedCommand):
                    self.stop_by(PROTECTIVE)
                else:
                    self.end_program()
        self.arm.advance()
        self.send_packages()

    def send_packages(self, to: Peer | None = None) -> None:
        """Sends the requested outputs to each RTDE client, or only to `to`."""
        peers = [peer for peer in ([*self.peers] if to is None else [to]) if isinstance(peer, Rtde)]
        values = self.values(any(peer.asks_pose for peer in peers))
        for peer in peers:
            peer.send_package(values)

    def values(self, with_pose: bool) -> dict[str, Any]:
        """Returns the RTDE outputs."""
        runs = self.runtime == PLAYING
        q, velocity, pose = [*self.arm.q], [*self.arm.velocity], self.arm.pose() if with_pose else None
        return {
            **self.registers, **self.inputs,
            "timestamp": self.cycles * CYCLE, "target_q": [*self.arm.goal], "actual_q": q,
            "target_qd": velocity, "actual_qd": velocity, "actual_TCP_force": self.felt(),
            "actual_TCP_pose": pose, "target_TCP_pose": pose,
            "robot_mode": self.mode, "safety_mode": self.safety, "safety_status": self.safety, "runtime_state": self.runtime,
            "speed_scaling": self.speed_scaling, "target_speed_fraction": 1.0, "actual_digital_input_bits": self.digital_inputs,
            "actual_digital_output_bits": self.digital_outputs, "robot_status_bits": (self.mode == RUNNING) | runs << 1,
            "safety_status_bits": 1 << (self.safety - 1), "joint_mode": [253] * 6,
        }  # fmt: skip

    def felt(self) -> list[float]:
        """Returns the force and torque at the tool: the sum of contact and applied forces."""
        touched = [*self.arm.touch(), 0.0, 0.0, 0.0]
        return [own + pressed for own, pressed in zip(touched, self.force, strict=True)]

    def take(self, values: dict[str, Any]) -> None:
        """Stores the RTDE inputs."""
        mask = values.get("standard_digital_output_mask", 0)
        self.digital_outputs = self.digital_outputs & ~mask | values.get("standard_digital_output", 0) & mask
        self.inputs |= {name: value for name, value in values.items() if name.startswith("input_")}
        if self.lockstep:
            self.cycle()

    def _functions(self) -> dict[str, Callable[..., Any]]:
        def read(kind: str) -> Callable[[int], Any]:
            return lambda number: self.inputs.get(f"input_{kind}_register_{number}", 0)

        def write(kind: str) -> Callable[[int, Any], None]:
            return lambda number, value: self.registers.__setitem__(f"output_{kind}_register_{number}", value)

        def nothing(*_: Any, **__: Any) -> None:
            pass

        found: dict[str, Callable[..., Any]] = {
            "read_input_integer_register": read("int"), "read_input_float_register": read("double"),
            "write_output_integer_register": write("int"), "write_output_float_register": write("double"),
            "get_actual_joint_positions": lambda: [*self.arm.q], "get_target_joint_positions": lambda: [*self.arm.goal],
            "get_actual_tcp_pose": self.arm.pose, "get_steptime": lambda: CYCLE, "get_tcp_force": self.felt,
            "is_steady": lambda: not any(self.arm.velocity), "textmsg": lambda *words: self.log.append(" ".join(map(str, words))),
            "popup": lambda *words, **_: self.log.append(str(words[0])), "norm": abs,
            "floor": lambda value: int(value // 1),
        }  # fmt: skip
        return dict.fromkeys(_WITHOUT_EFFECT, nothing) | found

    def _listen_anywhere(self) -> str:
        """Binds a free loopback address of this host. The ports are fixed, because clients do not let the user choose them."""
        pid = os.getpid()
        for number in itertools.islice(_number, 200):
            try:
                return self._listen(f"127.{1 + pid // 250 % 250}.{1 + pid % 250}.{1 + number % 250}")
            except OSError as why:
                if why.errno != errno.EADDRINUSE:
                    raise
        refuse(DeviceFailed, "this host has no free address for an emulated controller", "pass one: host='127.0.0.2'")

    def _listen(self, host: str) -> str:
        kinds = [(kind, port) for kind, ports in ((Rtde, RTDE), (Dashboard, DASHBOARD), (Scripts, SCRIPTS)) for port in ports]
        made: list[tuple[type[Peer], socket.socket]] = []
        try:
            for kind, port in kinds:
                made.append((kind, socket.create_server((host, port))))
        except OSError:
            for _, listener in made:
                listener.close()
            raise
        for kind, listener in made:
            listener.setblocking(False)
            self._selector.register(listener, selectors.EVENT_READ, kind)
            self._listeners.append(listener)
        return host

    def _drop(self, peer: Peer) -> None:
        self.peers.remove(peer)
        self._selector.unregister(peer.socket)
        peer.socket.close()

    def _serve(self) -> None:
        due = time.monotonic()
        while not self._ends:
            left = None if self.lockstep else max(0.0, due - time.monotonic())
            for key, _ in self._selector.select(left):
                self._ready(key.fileobj, key.data)
            if not self.lockstep and time.monotonic() >= due:
                # Cycles missed by a slow machine are not made up for.
                due = max(due + CYCLE, time.monotonic() - 10 * CYCLE)
                self.cycle()
        for opened in [*self._listeners, *(peer.socket for peer in self.peers)]:
            opened.close()
        self._selector.close()

    def _ready(self, of: Any, data: Any) -> None:
        if of is self._woken:
            self._woken.recv(4096)
            while not self._orders.empty():
                order, answer = self._orders.get()
                answer.put(order())
        elif isinstance(data, Peer):
            if not data.receive():
                self._drop(data)
        elif of in self._listeners:
            try:
                connection, _ = of.accept()
            except BlockingIOError:
                return
            peer = data(self, connection)
            self.peers.append(peer)
            self._selector.register(connection, selectors.EVENT_READ, peer)


_WITHOUT_EFFECT = (
    "rtde_set_watchdog", "enter_critical", "exit_critical", "set_standard_digital_out", "set_tcp", "set_payload", "set_target_payload",
    "zero_ftsensor", "teach_mode", "end_teach_mode", "enter_critical_section", "force_mode_set_gain_scaling", "force_mode_set_damping",
    "set_gravity", "freedrive_mode", "end_freedrive_mode",
)  # fmt: skip
"""Functions in programs that are accepted but have no effect."""
