# SPDX-License-Identifier: Apache-2.0
"""A Modbus device for tests, over TCP or a pseudo-terminal."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping, Sequence
from types import TracebackType
from typing import Self

from .ends import SerialEnd, TcpEnd

ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE = 1, 2, 3
_FORMATS = {"int16": "h", "uint16": "H", "int32": "i", "uint32": "I", "int64": "q", "uint64": "Q", "float": "f", "double": "d"}


class Tables:
    """The four tables of a unit, which contain the value at each existing address. Register values are 0 to 65535."""

    def __init__(self) -> None:
        self.holding: dict[int, int] = {}
        self.input: dict[int, int] = {}
        self.coil: dict[int, bool] = {}
        self.discrete: dict[int, bool] = {}

    def put(self, table: str, address: int, value: float, type: str = "uint16") -> None:
        """Stores a number of this `type` in registers, most significant word first, or a bit in a coil or discrete input."""
        if table in ("coil", "discrete"):
            (self.coil if table == "coil" else self.discrete)[address] = bool(value)
            return
        whole = value if type in ("float", "double") else round(value)
        data = struct.pack(">" + _FORMATS[type], whole)
        words = struct.unpack(f">{len(data) // 2}H", data)
        (self.holding if table == "holding" else self.input).update(enumerate(words, address))

    def get(self, table: str, address: int, type: str = "uint16") -> float:
        """Returns the number at that `address`."""
        if table in ("coil", "discrete"):
            return (self.coil if table == "coil" else self.discrete)[address]
        registers = self.holding if table == "holding" else self.input
        count = struct.calcsize(">" + _FORMATS[type]) // 2
        data = struct.pack(f">{count}H", *(registers[address + at] for at in range(count)))
        return struct.unpack(">" + _FORMATS[type], data)[0]


class Modbus(Tables):
    """A Modbus device; `address` is for `gpac.drivers.modbus`. Its own tables are those of its first unit."""

    def __init__(self, units: Sequence[int], serial: bool) -> None:
        super().__init__()
        self.units: dict[int, Tables] = {unit: self if at == 0 else Tables() for at, unit in enumerate(units)}
        self.silent: set[int] = set()
        """Units that do not answer."""
        self.requests: dict[int, int] = dict.fromkeys(units, 0)
        """Number of requests to each unit."""
        self.identity: tuple[str, str, str] = ("OpenGPAC", "fake", "1")
        """Vendor, product code, version."""
        self._end: TcpEnd | SerialEnd = SerialEnd(self._rtu) if serial else TcpEnd(self._tcp)
        self.address: str = f"rtu/{self._end.path}" if isinstance(self._end, SerialEnd) else f"tcp/127.0.0.1:{self._end.port}"

    def start(self) -> Self:
        """Switches the device on."""
        self._end.start()
        return self

    def stop(self) -> None:
        """Switches the device off: closes connections, and does not answer requests. Its tables are preserved; `start` switches it on
        again."""
        self._end.stop()

    def close(self) -> None:
        """Closes the device, like the end of the `with` block."""
        self._end.close()

    def __enter__(self) -> Self:
        return self.start()

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def _tcp(self, came: bytearray, send: Callable[[bytes], None]) -> None:
        while len(came) >= 8:
            transaction, _, length, unit = struct.unpack_from(">HHHB", came)
            if len(came) < 6 + length:
                return
            request = bytes(came[7 : 6 + length])
            del came[: 6 + length]
            # A device alone answers to any unit, as most do over TCP.
            heard = unit if unit in self.units or len(self.units) > 1 else next(iter(self.units))
            answer = self._answer(heard, request)
            if answer is not None:
                send(struct.pack(">HHHB", transaction, 0, 1 + len(answer), unit) + answer)

    def _rtu(self, came: bytearray, send: Callable[[bytes], None]) -> None:
        while len(came) >= 2:
            length = _request_length(came)
            if length is None or len(came) < length:
                return
            frame = bytes(came[:length])
            if crc16(frame[:-2]) != frame[-2] | frame[-1] << 8:
                came.clear()
                return
            del came[:length]
            answer = self._answer(frame[0], frame[1:-2])
            if answer is not None:
                body = bytes([frame[0]]) + answer
                send(body + struct.pack("<H", crc16(body)))

    def _answer(self, unit: int, request: bytes) -> bytes | None:
        tables = self.units.get(unit)
        if tables is None:
            return None
        self.requests[unit] += 1
        if unit in self.silent:
            return None
        function = request[0]
        try:
            done = self._carried_out(tables, function, request[1:])
            return bytes([function | 0x80, ILLEGAL_FUNCTION]) if done is None else bytes([function]) + done
        except KeyError:
            return bytes([function | 0x80, ILLEGAL_ADDRESS])
        except (IndexError, struct.error):
            return bytes([function | 0x80, ILLEGAL_VALUE])

    def _carried_out(self, tables: Tables, function: int, rest: bytes) -> bytes | None:
        if function in (1, 2):
            bits = _range(tables.coil if function == 1 else tables.discrete, rest)
            packed = bytes(sum(bool(bit) << at for at, bit in enumerate(bits[i : i + 8])) for i in range(0, len(bits), 8))
            return bytes([len(packed)]) + packed
        if function in (3, 4):
            registers = _range(tables.holding if function == 3 else tables.input, rest)
            return bytes([2 * len(registers)]) + struct.pack(f">{len(registers)}H", *registers)
        if function in (5, 6):
            address, value = struct.unpack(">HH", rest)
            _range(tables.coil if function == 5 else tables.holding, struct.pack(">HH", address, 1))
            if function == 5:
                tables.coil[address] = value == 0xFF00
            else:
                tables.holding[address] = value
            return rest
        if function in (15, 16):
            address, count, _ = struct.unpack(">HHB", rest[:5])
            _range(tables.coil if function == 15 else tables.holding, rest[:4])
            if function == 15:
                tables.coil.update({address + at: bool(rest[5 + at // 8] >> at % 8 & 1) for at in range(count)})
            else:
                tables.holding.update(enumerate(struct.unpack(f">{count}H", rest[5:]), address))
            return rest[:4]
        if function == 22:
            address, keep, changed = struct.unpack(">HHH", rest)
            (held,) = _range(tables.holding, struct.pack(">HH", address, 1))
            tables.holding[address] = held & keep | changed & ~keep
            return rest
        if function == 0x2B and rest[:1] == b"\x0e":
            objects = b"".join(bytes([at, len(text)]) + text.encode() for at, text in enumerate(self.identity))
            return b"\x0e\x01\x01\x00\x00" + bytes([len(self.identity)]) + objects
        return None


def _range(table: Mapping[int, int] | Mapping[int, bool], rest: bytes) -> list[int]:
    address, count = struct.unpack(">HH", rest)
    return [table[address + at] for at in range(count)]


def _request_length(came: bytearray) -> int | None:
    function = came[1]
    if function in (15, 16):
        return 9 + came[6] if len(came) > 6 else None
    return {0x2B: 7, 22: 10}.get(function, 8)


def crc16(data: bytes) -> int:
    """Returns the checksum of a serial frame, CRC-16/MODBUS, computed bit by bit."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xA001 if crc & 1 else 0)
    return crc


def modbus(*, units: Sequence[int] = (1,), serial: bool = False) -> Modbus:
    """Creates a Modbus device for a test: `with gpac.drivers.fake.modbus() as device: device.put("input", 0, 21.5, "float")`.

    It has the values `put` into its tables, and refuses other addresses, as real devices do. It uses a TCP port of this host, or,
    with `serial=True`, a pseudo-terminal. `units` are the devices on one line, `device.units[2]` the tables of unit 2; the units in
    `device.silent` do not answer. `stop()` and `start()` switch it off and on.
    """
    return Modbus(units, serial)
