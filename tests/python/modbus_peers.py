# SPDX-License-Identifier: Apache-2.0
"""Third-party Modbus devices: servers of pymodbus, over TCP and over a pair of pseudo terminals."""

from __future__ import annotations

import asyncio
import contextlib
import os
import select
import struct
import threading
import tty
from collections.abc import Coroutine, Iterator
from typing import Any

from pymodbus import FramerType
from pymodbus.server import ModbusSerialServer, ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

FORMATS = {"uint16": ">H", "int16": ">h", "float": ">f", "int32": ">i"}


class Peer:
    """Server of pymodbus with 64 addresses in each table, and access to them for tests."""

    def __init__(self, loop: asyncio.AbstractEventLoop, server: ModbusTcpServer | ModbusSerialServer, address: str, unit: int) -> None:
        self._loop, self._server, self.address, self._unit = loop, server, address, unit

    def _run(self, what: Coroutine[Any, Any, Any]) -> Any:
        return asyncio.run_coroutine_threadsafe(what, self._loop).result(30)

    def put(self, table: str, address: int, value: float, type: str = "uint16") -> None:
        """Sets a value, like `put` of `gpac.drivers.fake.modbus`."""
        if table in ("coil", "discrete"):
            self._run(self._server.async_setValues(self._unit, 5 if table == "coil" else 2, address, [bool(value)]))
            return
        data = struct.pack(FORMATS[type], value)
        words = list(struct.unpack(f">{len(data) // 2}H", data))
        self._run(self._server.async_setValues(self._unit, 16 if table == "holding" else 4, address, words))

    def get(self, table: str, address: int, type: str = "uint16") -> float:
        """Returns a value, like `get` of `gpac.drivers.fake.modbus`."""
        if table in ("coil", "discrete"):
            return self._run(self._server.async_getValues(self._unit, 1 if table == "coil" else 2, address, 1))[0]
        count = struct.calcsize(FORMATS[type]) // 2
        words = self._run(self._server.async_getValues(self._unit, 3 if table == "holding" else 4, address, count))
        return struct.unpack(FORMATS[type], struct.pack(f">{count}H", *words))[0]


def _device(unit: int) -> SimDevice:
    bits = [SimData(0, count=64, values=False, datatype=DataType.BITS)]
    words = [SimData(0, count=64, values=0, datatype=DataType.REGISTERS)]
    return SimDevice(unit, (bits, bits, words, words), use_bit_addressing=True)


@contextlib.contextmanager
def _loop() -> Iterator[asyncio.AbstractEventLoop]:
    loop = asyncio.new_event_loop()
    thread = threading.Thread(target=loop.run_forever, daemon=True)
    thread.start()
    try:
        yield loop
    finally:
        loop.call_soon_threadsafe(loop.stop)
        thread.join()
        loop.close()


@contextlib.contextmanager
def tcp(unit: int = 1) -> Iterator[Peer]:
    """Yields a server on a port of this host."""

    async def start() -> ModbusTcpServer:
        server = ModbusTcpServer(_device(unit), address=("127.0.0.1", 0))
        assert await server.listen()
        return server

    with _loop() as loop:
        server = asyncio.run_coroutine_threadsafe(start(), loop).result(30)
        port = server.transport.sockets[0].getsockname()[1]  # type: ignore[union-attr]
        try:
            yield Peer(loop, server, f"tcp/127.0.0.1:{port}", unit)
        finally:
            asyncio.run_coroutine_threadsafe(server.shutdown(), loop).result(30)


@contextlib.contextmanager
def cable() -> Iterator[tuple[str, str]]:
    """Yields two pseudo terminals that are the ends of one cable."""
    ends = [os.openpty() for _ in range(2)]
    for _, line in ends:
        tty.setraw(line)
    woken, wake = os.pipe()
    masters = [master for master, _ in ends]

    def carry() -> None:
        while True:
            ready, _, _ = select.select([*masters, woken], [], [])
            if woken in ready:
                return
            for master in ready:
                os.write(masters[1 - masters.index(master)], os.read(master, 4096))

    thread = threading.Thread(target=carry, daemon=True)
    thread.start()
    try:
        yield os.ttyname(ends[0][1]), os.ttyname(ends[1][1])
    finally:
        os.write(wake, b"x")
        thread.join()
        for descriptor in [woken, wake, *(each for end in ends for each in end)]:
            os.close(descriptor)


@contextlib.contextmanager
def rtu(unit: int = 1) -> Iterator[Peer]:
    """Yields a server on a pair of pseudo terminals."""

    async def start(path: str) -> ModbusSerialServer:
        server = ModbusSerialServer(_device(unit), framer=FramerType.RTU, port=path, baudrate=19200)
        assert await server.listen()
        return server

    with cable() as (mine, theirs), _loop() as loop:
        server = asyncio.run_coroutine_threadsafe(start(theirs), loop).result(30)
        try:
            yield Peer(loop, server, f"rtu/{mine}?baud=19200&parity=none", unit)
        finally:
            asyncio.run_coroutine_threadsafe(server.shutdown(), loop).result(30)
