# SPDX-License-Identifier: Apache-2.0
"""Signals of a cell offered to a controller that polls by Modbus, here pymodbus."""

from __future__ import annotations

import contextlib
import re
import socket
import struct
from collections.abc import Iterator

import pytest
from pymodbus.client import ModbusTcpClient

import opengpac as gpac
from afar import until
from opengpac.cell import AnalogInput, AnalogOutput, DigitalInput, DigitalOutput, set_output
from ports import held_port

CHANNELS = {
    "wanted": {"holding": 100, "type": "float", "unit": "mm"},
    "recipe": {"holding": 102},
    "start": {"coil": 0},
    "position": {"input": 0, "type": "int32", "scale": 0.001, "unit": "mm", "write": True, "safe": -1.0},
    "busy": {"discrete": 4, "write": True},
    "count": {"holding": 10, "write": True},
}


@pytest.fixture
def port() -> Iterator[int]:
    """Yields a port that is assigned to no other program."""
    with held_port() as held:
        yield held


@pytest.fixture
def cell() -> Iterator[gpac.System]:
    """Yields a system in real time."""
    with gpac.System("cell") as made:
        yield made


class Offered:
    """Cell that offers signals at a port."""

    def __init__(self, cell: gpac.System, port: int, **options: object) -> None:
        self.cell, self.port = cell, port
        rtp = cell.processor("rtp0")
        slow = rtp.timer("slow", period="10 ms", priority=60)
        driver = gpac.drivers.modbus_server(f"tcp/127.0.0.1:{self.port}", channels=CHANNELS, age_max="60 s", **options)  # type: ignore[arg-type]
        self.device = rtp.physical_device("line", driver, exchange=slow)
        self.wanted = AnalogInput("wanted", self.device["wanted"]).enable()
        self.start = DigitalInput("start", self.device["start"]).enable()
        self.position = AnalogOutput("position", self.device["position"], low=-1000, high=1000)
        self.busy = DigitalOutput("busy", self.device["busy"])

    @contextlib.contextmanager
    def client(self) -> Iterator[ModbusTcpClient]:
        """Yields a client, as a controller of the line."""
        client = ModbusTcpClient("127.0.0.1", port=self.port, timeout=30)
        assert client.connect()
        try:
            yield client
        finally:
            client.close()


def test_a_controller_reads_and_writes_signals(cell: gpac.System, port: int) -> None:
    offered = Offered(cell, port)
    with offered.client() as plc:
        until(lambda: plc.read_input_registers(0, count=2).registers == [0xFFFF, 0xFC18], "the safe value, -1 mm in micrometres")
        for device in (offered.position, offered.busy):
            device.enable()
        set_output(offered.position, 12.345)
        set_output(offered.busy, True)
        until(lambda: plc.read_input_registers(0, count=2).registers == [0, 12345], "the position is offered")
        until(lambda: plc.read_discrete_inputs(4, count=1).bits[0], "that it is busy is offered")
        plc.write_registers(100, list(struct.unpack(">2H", struct.pack(">f", 2.5))))
        plc.write_coil(0, True)
        until(lambda: (offered.wanted.value.value, offered.start.value.value) == (2.5, True), "what it wrote is read")
        assert plc.write_register(10, 1).exception_code == 2, "what is written here is not written there"
        assert plc.read_holding_registers(11, count=1).exception_code == 2
        assert plc.read_coils(0, count=2).exception_code == 2
        assert getattr(plc.read_device_information(), "information")[0] == b"OpenGPAC"  # noqa: B009
        cell.emergency_stop("test")
        until(lambda: plc.read_input_registers(0, count=2).registers == [0xFFFF, 0xFC18], "it is safe again")


def test_one_is_written_by_either_function_and_answered_by_that_one(cell: gpac.System, port: int) -> None:
    offered = Offered(cell, port)
    recipe, start = offered.device["recipe"], offered.device["start"]
    with offered.client() as plc:
        for value in (True, False):
            one, several = plc.write_coil(0, not value), plc.write_coils(0, [value])
            word, words = plc.write_register(102, 0), plc.write_registers(102, [7])
            answers = [(answer.isError(), answer.function_code) for answer in (one, several, word, words)]
            assert answers == [(False, function) for function in (5, 15, 6, 16)]
            until(lambda value=value: (cell.read(start)[0], cell.read(recipe)[0]) == (value, 7), "both are as they were written last")


def test_clients_that_are_slow_silent_or_mad_delay_nobody(cell: gpac.System, port: int) -> None:
    offered = Offered(cell, port, clients=4)
    with contextlib.ExitStack() as stack:

        def connected() -> socket.socket:
            return stack.enter_context(socket.create_connection(("127.0.0.1", offered.port), timeout=30))

        half, deaf, mad = connected(), connected(), connected()
        half.sendall(b"\0\1\0\0\0\6\1")
        request = b"\0\1\0\0\0\6\1\4\0\0\0\2"
        deaf.setblocking(False)
        with contextlib.suppress(BlockingIOError):
            # The client reads none of its answers, until it can send no more.
            while True:
                deaf.send(100 * request)
        mad.sendall(b"GET / HTTP/1.1\r\n\r\n")
        assert mad.recv(1) == b"", "its connection ends"
        with offered.client() as plc:
            until(lambda: plc.read_input_registers(0, count=2).registers == [0xFFFF, 0xFC18], "the others are answered")
            # More connections than permitted: the one that was silent longest is closed, here the one with half a request.
            others = [connected() for _ in range(2)]
            for other in others:
                other.sendall(request)
                assert len(other.recv(100)) == 13
            assert half.recv(1) == b""
            assert plc.read_input_registers(0, count=2).registers == [0xFFFF, 0xFC18]


def test_silent_clients_are_a_lost_device(cell: gpac.System, port: int) -> None:
    offered = Offered(cell, port, silent="0.2 s")
    with offered.client() as plc:
        plc.write_coil(0, True)
        until(lambda: offered.start.state == "fault", "nobody asks any more")
        offered.device.reopen()
        offered.start.enable()
        assert offered.start.value.value is False, "opened again it knows nothing of before"


def test_it_listens_on_this_host_unless_told(port: int) -> None:
    with gpac.System("cell", clock="virtual") as cell:
        rtp = cell.processor("rtp0")
        slow = rtp.timer("slow", period="10 ms", priority=60)
        with pytest.raises(gpac.Error, match=re.escape("set to_network=true")):
            rtp.physical_device("line", gpac.drivers.modbus_server("tcp/0.0.0.0:1502", channels=CHANNELS), exchange=slow)
        made = gpac.drivers.modbus_server(f"tcp/0.0.0.0:{port}", channels=CHANNELS, to_network=True)
        assert rtp.physical_device("line", made, exchange=slow)["busy"] is not None
        wrong = {"x": {"input": 0}}
        with pytest.raises(gpac.Error, match='a client cannot write to the table "input", so this channel would get no values'):
            rtp.physical_device("other", gpac.drivers.modbus_server("tcp/127.0.0.1:1502", channels=wrong), exchange=slow)
