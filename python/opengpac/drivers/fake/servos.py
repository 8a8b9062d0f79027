# SPDX-License-Identifier: Apache-2.0
"""Servos on a pseudo-terminal that answer like Feetech STS or Dynamixel 2.0 servos, and move."""

from __future__ import annotations

import contextlib
import os
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

from ...errors import CallError, did_you_mean, refuse
from ...refusals.argument_types import taking
from . import servo_frames as words
from .ends import Closing, Terminal
from .servo_frames import BROADCAST, Dynamixel2, Request, Sts


@dataclass(frozen=True)
class _Table:
    """Register table of a servo."""

    frames: type[Sts] | type[Dynamixel2]
    numbers: Mapping[str, int]
    """Model numbers by name."""
    set: Mapping[int, tuple[int, int]]
    """Sizes in bytes and initial values of registers, by address."""
    model: int
    torque: int
    goal: int
    wide: int
    """Size of a position in bytes."""
    position: int
    velocity: int
    voltage: tuple[int, int]
    temperature: int
    error: int


_STS = _Table(
    Sts, {"sts3215": 777, "sts3250": 2825},
    {5: (1, 1), 7: (1, 0), 8: (1, 1), 9: (2, 0), 11: (2, 4095), 13: (1, 70), 16: (2, 1000), 48: (2, 1000), 55: (1, 1)},
    model=3, torque=40, goal=42, wide=2, position=56, velocity=58, voltage=(62, 1), temperature=63, error=65,
)  # fmt: skip
_DYNAMIXEL = _Table(
    Dynamixel2, {"xl330-m288": 1200, "xl330-m077": 1190, "xl430-w250": 1060, "xm430-w350": 1020},
    {6: (1, 46), 7: (1, 1), 8: (1, 1), 9: (1, 0), 11: (1, 3), 13: (1, 2), 48: (4, 4095), 52: (4, 0), 68: (1, 2)},
    model=0, torque=64, goal=116, wide=4, position=132, velocity=128, voltage=(144, 2), temperature=146, error=70,
)  # fmt: skip
_TABLES = {"feetech": _STS, "dynamixel": _DYNAMIXEL}
_ACCESS, _LIMIT, _INSTRUCTION, _RANGE, _ALERT = 7, 6, 2, 4, 0x80
_WATCHDOG, _WATCHDOG_UNIT, _TRIPPED = 98, 0.02, 0xFF
_GOALS = range(100, 120)


class FakeServo:
    """A servo with registers and first-order motion: each time its position is read, the distance to its goal shrinks by the fraction
    `follow`."""

    def __init__(self, table: _Table, id: int, number: int, position: int, follow: float) -> None:
        self._table = table
        self.id, self.follow = id, follow
        self.registers = bytearray(256)
        self._heard = 0.0
        self._position = float(position)
        for address, (length, value) in table.set.items():
            self.store(address, length, value)
        self.store(table.model, 2, number)
        self.store(5 if table is _STS else 7, 1, id)
        self.store(table.voltage[0], table.voltage[1], 120)
        self.store(table.temperature, 1, 30)
        self.store(table.goal, table.wide, position)
        self.store(table.position, table.wide, position)

    def value(self, address: int, length: int) -> int:
        """Returns the value of a register."""
        return int.from_bytes(self.registers[address : address + length], "little")

    def store(self, address: int, length: int, value: int) -> None:
        """Sets a register, even a read-only one."""
        self.registers[address : address + length] = (value & (1 << 8 * length) - 1).to_bytes(length, "little")

    @property
    def position(self) -> float:
        """Position in counts. Setting it moves the servo as if by hand."""
        return self._position

    @position.setter
    def position(self, counts: float) -> None:
        self._position = float(counts)
        self.store(self._table.position, self._table.wide, round(counts))

    @property
    def goal(self) -> int:
        """Goal in counts."""
        return self.value(self._table.goal, self._table.wide)

    @property
    def torque(self) -> bool:
        """True if the servo holds its goal."""
        return self.registers[self._table.torque] != 0

    @property
    def error(self) -> int:
        """Error bits; can be set. For Feetech and Dynamixel, 4 is overheating and 32 overload."""
        return self.registers[self._table.error]

    @error.setter
    def error(self, bits: int) -> None:
        self.registers[self._table.error] = bits

    @property
    def stopped(self) -> bool:
        """True if the watchdog has stopped the servo; only Dynamixel servos have one."""
        return self._table is _DYNAMIXEL and self.registers[_WATCHDOG] == _TRIPPED

    def _hear(self, now: float) -> None:
        """Records activity on the line. If the line was silent for longer than the watchdog time, the watchdog stops the servo, which
        then accepts no goals."""
        units, silent = self.registers[_WATCHDOG], now - self._heard
        self._heard = now
        if self._table is _DYNAMIXEL and self.torque and 0 < units < _TRIPPED and silent > units * _WATCHDOG_UNIT:
            self.registers[_WATCHDOG] = _TRIPPED
            self.store(self._table.goal, self._table.wide, round(self._position))

    def _answered(self) -> int:
        """Returns the error bits as encoded in answers."""
        return self.error if self._table is _STS else _ALERT * (self.error != 0)

    def _read(self, address: int, length: int) -> bytes:
        table = self._table
        if address <= table.position < address + length:
            before = self._position
            if self.torque:
                self.position = before + self.follow * (self.goal - before)
            moved = round(self._position - before)
            self.store(table.velocity, table.wide, moved if table is _DYNAMIXEL or moved >= 0 else 0x8000 - moved)
        return bytes(self.registers[address : address + length])

    def _write(self, address: int, body: bytes) -> int:
        """Writes registers; returns the error number for Dynamixel, or 0 for Feetech."""
        table = self._table
        if table is _DYNAMIXEL:
            if address < table.torque and self.torque:
                return _ACCESS
            if address in _GOALS and self.stopped:
                return _RANGE
            if address == table.goal and not self.value(52, 4) <= int.from_bytes(body, "little", signed=True) <= self.value(48, 4):
                return _LIMIT
        self.registers[address : address + len(body)] = body
        return 0

    def _reboot(self) -> None:
        self.registers[self._table.torque] = 0
        self.error = 0


@dataclass
class FakeServos:
    """A bus of servos; `port` is for the driver. The bus is closed by `close()`, or at the end of its `with` block.

    `unplug()` disconnects its adapter and `plug()` reconnects it under the same name. `mute` is the number of requests to leave
    unanswered, `garble` the number of answers to corrupt; each counts down. `requests` is the number of requests received. `clock`
    (s) is the time base of the servos' watchdogs.
    """

    table: _Table
    servos: dict[int, FakeServo]
    echo: bool = False
    mute: int = 0
    garble: int = 0
    requests: int = 0
    clock: Callable[[], float] = time.monotonic
    _folder: Any = field(default_factory=lambda: tempfile.TemporaryDirectory(prefix="servos-"))
    _line: _Line | None = None

    def __post_init__(self) -> None:
        self.plug()

    @property
    def port(self) -> str:
        """Path of the line: a symbolic link that stays the same after `plug()`."""
        return str(Path(self._folder.name) / "ttyServos")

    def __getitem__(self, id: int) -> FakeServo:
        return self.servos[id]

    def plug(self) -> None:
        """Reconnects the adapter; the servos keep their state, but their torque is off."""
        if self._line is None:
            for servo in self.servos.values():
                servo.registers[self.table.torque] = 0
            self._line = _Line(self)
            with contextlib.suppress(FileNotFoundError):
                os.unlink(self.port)
            os.symlink(self._line.path, self.port)

    def unplug(self) -> None:
        """Disconnects the adapter: the line disappears."""
        if self._line is not None:
            self._line.close()
            self._line = None
            os.unlink(self.port)

    def close(self) -> None:
        """Closes the bus."""
        self.unplug()
        self._folder.cleanup()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _answers(self, frames: Sts | Dynamixel2, request: Request) -> bytes:
        """Returns the answers of all addressed servos to a request."""
        self.requests += 1
        now = self.clock()
        for servo in self.servos.values():
            servo._hear(now)
        if self.mute > 0:
            self.mute -= 1
            return b""
        said = [frames.answer(id, error, body) for id, error, body in self._said(request)]
        if said and self.garble > 0:
            self.garble -= 1
            said[0] = said[0][:-3] + bytes([said[0][-3] ^ 0x10]) + said[0][-2:]
        return b"".join(said)

    def _said(self, request: Request) -> Iterable[tuple[int, int, bytes]]:
        if request.word == words.SYNC_READ:
            for id in (id for id in request.rest if id in self.servos):
                yield id, self[id]._answered(), self[id]._read(request.address, request.length)
        elif request.word == words.SYNC_WRITE:
            step = request.length + 1
            for at in range(0, len(request.rest) - step + 1, step):
                row = request.rest[at : at + step]
                if row[0] in self.servos:
                    self[row[0]]._write(request.address, row[1:])
        elif request.id == BROADCAST:
            if request.word == words.PING and self.table is _DYNAMIXEL:
                for servo in self.servos.values():
                    yield self._own(servo, request)
        elif request.id in self.servos:
            yield self._own(self[request.id], request)

    def _own(self, servo: FakeServo, request: Request) -> tuple[int, int, bytes]:
        alert = servo._answered()
        match request.word:
            case words.PING:
                number = bytes(servo.registers[:2]) + bytes(servo.registers[6:7])
                return servo.id, alert, number if self.table is _DYNAMIXEL else b""
            case words.READ:
                return servo.id, alert, servo._read(request.address, request.length)
            case words.WRITE:
                return servo.id, alert | servo._write(request.address, request.body[request.width :]), b""
            case words.REBOOT if self.table is _DYNAMIXEL:
                servo._reboot()
                return servo.id, 0, b""
            case _:
                return servo.id, alert | (_INSTRUCTION if self.table is _DYNAMIXEL else 0), b""


class _Line:
    """A pseudo-terminal, and the thread that serves it."""

    def __init__(self, bus: FakeServos) -> None:
        self._bus = bus
        self._terminal, self._closing = Terminal(), Closing()
        self.path = self._terminal.path
        self._thread = threading.Thread(target=self._serve, name="servos", daemon=True)
        self._thread.start()

    def _serve(self) -> None:
        frames, stream = self._bus.table.frames(), bytearray()
        while self._closing.readable(self._terminal.device):
            came = self._terminal.read()
            if self._bus.echo:
                self._terminal.write(came)
            stream += came
            while (request := frames.take(stream)) is not None:
                self._terminal.write(self._bus._answers(frames, request))

    def close(self) -> None:
        """Stops the thread, then closes the pseudo-terminal; a program that has it open sees a disconnect."""
        self._closing.tell()
        self._thread.join()
        self._terminal.close()
        self._closing.close()


@taking
def servos(
    kind: str = "feetech",
    ids: Iterable[int] = range(1, 7),
    *,
    model: str | None = None,
    position: int = 2048,
    follow: float = 0.5,
    echo: bool = False,
    clock: Callable[[], float] = time.monotonic,
) -> FakeServos:
    """Creates servos on a pseudo-terminal, to test programs for a real arm: `with gpac.drivers.fake.servos("feetech") as bus:`.

    `kind` is as in the driver, `model` is one of its models, `position` (counts) is the initial position; each time its position is
    read, a servo's distance to its goal shrinks by the fraction `follow`. With `echo`, the adapter echoes sent bytes. `clock` is the
    time base of the watchdogs of Dynamixel servos, s.
    """
    if kind not in _TABLES:
        refuse(CallError, f"there is no kind of servo {kind!r}", did_you_mean(str(kind), _TABLES) or f"choose one of {', '.join(_TABLES)}")
    table = _TABLES[kind]
    name = model or next(iter(table.numbers))
    if name not in table.numbers:
        refuse(CallError, f"there is no model {name!r} of kind '{kind}'", f"choose one of {', '.join(table.numbers)}")
    return FakeServos(table, {id: FakeServo(table, id, table.numbers[name], position, follow) for id in ids}, echo, clock=clock)
