# SPDX-License-Identifier: Apache-2.0
"""A drive by CiA 402 on the package `canopen`.

Its SDO server, network management, heartbeat, emergencies and PDOs are that package's; its objects, state machine and motor are ours."""

from __future__ import annotations

import threading
from typing import Any

import canopen
from canopen.objectdictionary import (
    INTEGER8,
    INTEGER16,
    INTEGER32,
    UNSIGNED8,
    UNSIGNED16,
    UNSIGNED32,
    VISIBLE_STRING,
    ObjectDictionary,
    ODArray,
    ODRecord,
    ODVariable,
)

OFF, READY, ON, ENABLED, STOPPING, FAULT = 0x50, 0x31, 0x33, 0x37, 0x17, 0x18


def dictionary(node: int) -> ObjectDictionary:
    """The objects of the drive."""
    made = ObjectDictionary()
    made.node_id = node

    def variable(name: str, index: int, kind: int, default: Any, sub: int = 0, access: str = "rw") -> ODVariable:
        one = ODVariable(name, index, sub)
        one.data_type, one.default, one.access_type, one.pdo_mappable = kind, default, access, True
        return one

    single = [
        ("device type", 0x1000, UNSIGNED32, 0x00020192), ("error register", 0x1001, UNSIGNED8, 0), ("sync id", 0x1005, UNSIGNED32, 0x80),
        ("cycle", 0x1006, UNSIGNED32, 0), ("name", 0x1008, VISIBLE_STRING, "peer drive"), ("emergency id", 0x1014, UNSIGNED32, 0x80 + node),
        ("heartbeat", 0x1017, UNSIGNED16, 0), ("without controller", 0x6007, INTEGER16, 1), ("error", 0x603F, UNSIGNED16, 0),
        ("control", 0x6040, UNSIGNED16, 0), ("status", 0x6041, UNSIGNED16, OFF), ("mode", 0x6060, INTEGER8, 0),
        ("shown mode", 0x6061, INTEGER8, 0), ("position", 0x6064, INTEGER32, 1000), ("velocity", 0x606C, INTEGER32, 0),
        ("target torque", 0x6071, INTEGER16, 0), ("torque", 0x6077, INTEGER16, 0), ("target position", 0x607A, INTEGER32, 0),
        ("target velocity", 0x60FF, INTEGER32, 0), ("modes", 0x6502, UNSIGNED32, 0x3A0),
    ]  # fmt: skip
    for name, index, kind, default in single:
        made.add_object(variable(name, index, kind, default))

    def several(name: str, index: int, kinds: list[tuple[str, int, Any]], of: type = ODRecord) -> None:
        group = of(name, index)
        group.add_member(variable("count", index, UNSIGNED8, len(kinds)))
        for sub, (member, kind, default) in enumerate(kinds, 1):
            group.add_member(variable(member, index, kind, default, sub))
        made.add_object(group)

    several("consumer", 0x1016, [("1", UNSIGNED32, 0)], ODArray)
    several(
        "identity", 0x1018, [(name, UNSIGNED32, value) for name, value in [("vendor", 7), ("product", 402), ("revision", 1), ("serial", 9)]]
    )
    several("period", 0x60C2, [("value", UNSIGNED8, 1), ("power", INTEGER8, -3)])
    for number in range(2):
        unused = 0x80000000 if number else 0
        for index, mapping, at in [(0x1400, 0x1600, 0x200 + node), (0x1800, 0x1A00, 0x40000180 + node)]:
            pdo = at + 0x100 * number | unused
            several(f"pdo {index + number:x}", index + number, [("id", UNSIGNED32, pdo), ("type", UNSIGNED8, 255)])
            several(f"map {mapping + number:x}", mapping + number, [(str(sub), UNSIGNED32, 0) for sub in range(1, 9)])
    return made


class Peer:
    """The drive, on an interface of SocketCAN."""

    def __init__(self, channel: str, node: int) -> None:
        self.id = node
        self.network = canopen.Network()
        self.network.connect(interface="socketcan", channel=channel)
        self.node = canopen.LocalNode(node, dictionary(node))
        self.network.add_node(self.node)
        self.value = {name: self.node.sdo[index] for name, index in {
            "control": 0x6040, "status": 0x6041, "mode": 0x6060, "position": 0x6064, "velocity": 0x606C,
            "target": 0x607A, "rate": 0x60FF, "error": 0x603F,
        }.items()}  # fmt: skip
        self.state = OFF
        self.heard = 0
        self.syncs = 0
        self.had_reset = False
        self.lock = threading.Lock()
        self.network.subscribe(0x80, self.synchronise)
        self.network.subscribe(0x77F, lambda *_: self.hear())
        self.node.nmt.send_command(0)
        self.node.nmt.state = "PRE-OPERATIONAL"

    def hear(self) -> None:
        """A heartbeat of the controller."""
        self.heard += 1

    def synchronise(self, *_: Any) -> None:
        """A SYNC: the state machine and the motor go on, and what is measured is sent."""
        with self.lock:
            if self.node.nmt.state != "OPERATIONAL":
                return
            if self.syncs == 0:
                self.start()
            self.syncs += 1
            self.change(self.value["control"].raw)
            self.move()
            self.value["status"].raw = self.state
            for number in (1, 2):
                pdo = self.node.tpdo[number]
                if pdo.enabled:
                    for variable in pdo.map:
                        variable.raw = self.node.sdo[variable.index].raw
                    pdo.transmit()

    def start(self) -> None:
        """The PDOs are those that the controller has configured."""
        self.node.tpdo.read()
        self.node.rpdo.read()
        self.node.rpdo[1].add_callback(self.receive)

    def receive(self, pdo: Any) -> None:
        """What a PDO brings is stored."""
        for variable in pdo.map:
            self.node.sdo[variable.index].raw = variable.raw

    def change(self, control: int) -> None:
        """The state machine of CiA 402."""
        reset = bool(control & 0x80)
        if self.state == FAULT:
            if reset and not self.had_reset:
                self.state = OFF
                self.value["error"].raw = 0
        elif not control & 0x02:
            self.state = OFF
        elif not control & 0x04:
            self.state = STOPPING if self.state == ENABLED else OFF
        elif control & 0x07 == 0x06:
            self.state = READY
        elif control & 0x0F == 0x07 and self.state in (READY, ENABLED):
            self.state = ON
        elif control & 0x0F == 0x0F and self.state in (ON, ENABLED):
            self.state = ENABLED
        self.had_reset = reset

    def move(self) -> None:
        """The motor is where it is told to be."""
        before = self.value["position"].raw
        if self.state == ENABLED and self.value["mode"].raw == 8:
            self.value["position"].raw = self.value["target"].raw
        self.value["velocity"].raw = self.value["position"].raw - before

    def fail(self, code: int) -> None:
        """Something is wrong with it: a fault, and an emergency."""
        with self.lock:
            self.state = FAULT
            self.value["error"].raw = code
            self.node.emcy.send(code)

    def restart(self) -> None:
        """As after its voltage came back."""
        with self.lock:
            self.state, self.syncs = OFF, 0
            self.node.nmt.stop_heartbeat()
            self.value["control"].raw = 0
            self.node.nmt.state = "PRE-OPERATIONAL"
            self.network.send_message(0x700 + self.id, [0])

    def close(self) -> None:
        """Leaves the bus."""
        self.network.disconnect()
