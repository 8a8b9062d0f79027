# SPDX-License-Identifier: Apache-2.0
"""A CAN adapter on a pseudo terminal, with a CiA 401 I/O module on its bus: a node on this host simulated by the package `canopen`."""

from __future__ import annotations

import os
import pty
import secrets
import select
import termios
import threading
import tty
from typing import Self

import can
import canopen
from canopen.objectdictionary import ODArray, ODVariable, datatypes

INPUTS, OUTPUTS, ANALOG_IN, ANALOG_OUT, IDENTITY = 0x6000, 0x6200, 0x6401, 0x6411, 0x1018


def dictionary() -> canopen.ObjectDictionary:
    """Returns the object dictionary of the module: initial values by index, subindex and type."""
    made = canopen.ObjectDictionary()
    for index, subindex, kind, value in [
        (INPUTS, 1, datatypes.UNSIGNED8, 0),
        (OUTPUTS, 1, datatypes.UNSIGNED8, 0),
        (ANALOG_IN, 1, datatypes.INTEGER16, 0),
        (ANALOG_OUT, 1, datatypes.INTEGER16, 0),
        (IDENTITY, 4, datatypes.UNSIGNED32, 1234),
    ]:
        array = ODArray(f"object_{index:x}", index)
        variable = ODVariable("value", index, subindex)
        variable.data_type, variable.default, variable.access_type = kind, value, "rw"
        array.add_member(variable)
        made.add_object(array)
    return made


class Adapter:
    """Adapter whose frames are lines, `t6012ABCD`; `port` is its terminal."""

    def __init__(self, node: int = 1) -> None:
        name = secrets.token_hex(6)
        self.network = canopen.Network()
        self.network.connect(interface="virtual", channel=name)
        self.module = canopen.LocalNode(node, dictionary())
        self.network.add_node(self.module)
        self._bus = can.Bus(interface="virtual", channel=name)
        self._master, self._slave = pty.openpty()
        tty.setraw(self._slave)
        self.port = os.ttyname(self._slave)
        self.is_silent = False
        self._ends, self._end = os.pipe()
        self._threads = [threading.Thread(target=serve, daemon=True) for serve in (self._from_line, self._from_bus)]
        for thread in self._threads:
            thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        os.write(self._end, b"x")
        for thread in self._threads:
            thread.join()
        self._bus.shutdown()
        self.network.disconnect()
        for file in (self._master, self._slave, self._ends, self._end):
            os.close(file)

    def _from_line(self) -> None:
        came = bytearray()
        while self._ends not in select.select([self._master, self._ends], [], [])[0]:
            came += os.read(self._master, 4096)
            *lines, rest = came.split(b"\r")
            came = bytearray(rest)
            for line in lines:
                if line == b"O":
                    # Discards data that an earlier program has not read.
                    termios.tcflush(self._slave, termios.TCIFLUSH)
                if line[:1] == b"t" and not self.is_silent:
                    data = bytes.fromhex(line[5 : 5 + 2 * int(line[4:5])].decode())
                    self._bus.send(can.Message(arbitration_id=int(line[1:4], 16), data=data, is_extended_id=False))

    def _from_bus(self) -> None:
        while not select.select([self._ends], [], [], 0)[0]:
            message = self._bus.recv(0.05)
            if message is not None:
                os.write(self._master, f"t{message.arbitration_id:03X}{message.dlc}{message.data.hex().upper()}\r".encode())
