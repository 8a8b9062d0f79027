# SPDX-License-Identifier: Apache-2.0
"""A CiA 402 drive and a CiA 401 module on the package `canopen`.

SDO server, network management, heartbeat, emergencies and PDOs come from that package; objects, state machine and motor are ours.
"""

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


HOME, START, FOUND = 6, 0x10, 0x1400


def variable(name: str, index: int, kind: int, default: Any, sub: int = 0, access: str = "rw") -> ODVariable:
    """Returns an object, or an entry of one."""
    one = ODVariable(name, index, sub)
    one.data_type, one.default, one.access_type, one.pdo_mappable = kind, default, access, True
    return one


def several(made: ObjectDictionary, name: str, index: int, kinds: list[tuple[str, int, Any]], of: type = ODRecord) -> None:
    """Adds an object with entries."""
    group = of(name, index)
    group.add_member(variable("count", index, UNSIGNED8, len(kinds)))
    for sub, (member, kind, default) in enumerate(kinds, 1):
        group.add_member(variable(member, index, kind, default, sub))
    made.add_object(group)


def common(node: int, kind: int, name: str, pdos: int) -> ObjectDictionary:
    """Returns the objects that every node has."""
    made = ObjectDictionary()
    made.node_id = node
    single = [
        ("device type", 0x1000, UNSIGNED32, kind), ("error register", 0x1001, UNSIGNED8, 0), ("sync id", 0x1005, UNSIGNED32, 0x80),
        ("cycle", 0x1006, UNSIGNED32, 0), ("name", 0x1008, VISIBLE_STRING, name), ("emergency id", 0x1014, UNSIGNED32, 0x80 + node),
        ("heartbeat", 0x1017, UNSIGNED16, 0),
    ]  # fmt: skip
    for title, index, of, default in single:
        made.add_object(variable(title, index, of, default))
    several(made, "consumer", 0x1016, [("1", UNSIGNED32, 0)], ODArray)
    identity = [(title, UNSIGNED32, value) for title, value in [("vendor", 7), ("product", 402), ("revision", 1), ("serial", 9)]]
    several(made, "identity", 0x1018, identity)
    for number in range(pdos):
        unused = 0x80000000 if number else 0
        for index, mapping, at in [(0x1400, 0x1600, 0x200 + node), (0x1800, 0x1A00, 0x40000180 + node)]:
            pdo = at + 0x100 * number | unused
            several(made, f"pdo {index + number:x}", index + number, [("id", UNSIGNED32, pdo), ("type", UNSIGNED8, 255)])
            several(made, f"map {mapping + number:x}", mapping + number, [(str(sub), UNSIGNED32, 0) for sub in range(1, 9)])
    return made


def dictionary(node: int) -> ObjectDictionary:
    """Returns the objects of the drive."""
    made = common(node, 0x00020192, "peer drive", 2)
    single = [
        ("without controller", 0x6007, INTEGER16, 1), ("error", 0x603F, UNSIGNED16, 0),
        ("control", 0x6040, UNSIGNED16, 0), ("status", 0x6041, UNSIGNED16, OFF), ("quick stop option", 0x605A, INTEGER16, 2),
        ("mode", 0x6060, INTEGER8, 0), ("shown mode", 0x6061, INTEGER8, 0), ("position", 0x6064, INTEGER32, 1000),
        ("velocity", 0x606C, INTEGER32, 0), ("target torque", 0x6071, INTEGER16, 0), ("torque", 0x6077, INTEGER16, 0),
        ("target position", 0x607A, INTEGER32, 0), ("home offset", 0x607C, INTEGER32, 0), ("homing method", 0x6098, INTEGER8, 0),
        ("homing acceleration", 0x609A, UNSIGNED32, 0), ("target velocity", 0x60FF, INTEGER32, 0), ("modes", 0x6502, UNSIGNED32, 0x3A0),
    ]  # fmt: skip
    for name, index, kind, default in single:
        made.add_object(variable(name, index, kind, default))
    several(made, "homing speeds", 0x6099, [("switch", UNSIGNED32, 0), ("zero", UNSIGNED32, 0)])
    several(made, "period", 0x60C2, [("value", UNSIGNED8, 1), ("power", INTEGER8, -3)])
    several(made, "digital outputs", 0x60FE, [("outputs", UNSIGNED32, 1), ("mask", UNSIGNED32, 0)])
    return made


def terminals(node: int) -> ObjectDictionary:
    """Returns the objects of the module: 16 digital and 2 analog terminals in each direction."""
    made = common(node, 0x000F0191, "peer module", 4)
    for name, index, kind in [
        ("inputs", 0x6000, UNSIGNED8), ("outputs", 0x6200, UNSIGNED8), ("error modes", 0x6206, UNSIGNED8),
        ("error values", 0x6207, UNSIGNED8),
        ("analog inputs", 0x6401, INTEGER16), ("analog outputs", 0x6411, INTEGER16), ("analog error modes", 0x6443, UNSIGNED8),
        ("analog error values", 0x6444, INTEGER32),
    ]:  # fmt: skip
        several(made, name, index, [(str(number), kind, 0) for number in (1, 2)], ODArray)
    several(made, "error behaviour", 0x1029, [("communication", UNSIGNED8, 0)], ODArray)
    return made


class Node:
    """Node on a SocketCAN interface; a subclass implements its reaction to a SYNC."""

    def __init__(self, channel: str, node: int, objects: ObjectDictionary) -> None:
        self.id = node
        self.network = canopen.Network()
        self.network.connect(interface="socketcan", channel=channel)
        self.node = canopen.LocalNode(node, objects)
        self.network.add_node(self.node)
        self.syncs = 0
        self.lock = threading.Lock()
        self.network.subscribe(0x80, self.synchronise)
        self.node.nmt.send_command(0)
        self.node.nmt.state = "PRE-OPERATIONAL"

    def synchronise(self, *_: Any) -> None:
        """Handles a SYNC: advances the node, and sends its measurements."""
        with self.lock:
            if self.node.nmt.state != "OPERATIONAL":
                return
            if self.syncs == 0:
                self.start()
            self.syncs += 1
            self.go_on()
            for pdo in self.node.tpdo.values():
                if pdo.enabled and pdo.map:
                    for mapped in pdo.map:
                        mapped.raw = self.of(mapped).raw
                    pdo.transmit()

    def go_on(self) -> None:
        """Advances the node at each SYNC."""

    def start(self) -> None:
        """Starts with the PDOs that the controller has configured."""
        self.node.tpdo.read()
        self.node.rpdo.read()
        for pdo in self.node.rpdo.values():
            if pdo.enabled:
                pdo.add_callback(self.receive)

    def of(self, mapped: Any) -> Any:
        """Returns the mapped object."""
        found = self.node.sdo[mapped.index]
        return found if hasattr(found, "raw") else found[mapped.subindex]

    def receive(self, pdo: Any) -> None:
        """Stores the contents of a PDO."""
        for mapped in pdo.map:
            self.of(mapped).raw = mapped.raw

    def close(self) -> None:
        """Leaves the bus."""
        self.network.disconnect()


class Peer(Node):
    """CiA 402 drive."""

    def __init__(self, channel: str, node: int) -> None:
        self.state = OFF
        self.heard = 0
        self.had_reset = False
        self.had_start = False
        self.found = 0
        super().__init__(channel, node, dictionary(node))
        self.value = {name: self.node.sdo[index] for name, index in {
            "control": 0x6040, "status": 0x6041, "mode": 0x6060, "shown": 0x6061, "position": 0x6064, "velocity": 0x606C,
            "target": 0x607A, "rate": 0x60FF, "error": 0x603F, "home": 0x607C,
        }.items()}  # fmt: skip
        self.network.subscribe(0x77F, lambda *_: self.hear())

    def hear(self) -> None:
        """Notes a heartbeat of the controller."""
        self.heard += 1

    def go_on(self) -> None:
        """Advances the state machine and the motor."""
        control = self.value["control"].raw
        self.change(control)
        self.look_for_home(control)
        self.move()
        self.value["shown"].raw = self.value["mode"].raw
        self.value["status"].raw = self.state | self.found

    def look_for_home(self, control: int) -> None:
        """Homes in place: sets the present position to the home offset."""
        starts = bool(control & START) and self.state == ENABLED and self.value["mode"].raw == HOME
        if starts and not self.had_start:
            self.value["position"].raw = self.value["home"].raw
            self.found = FOUND
        self.had_start = starts
        if self.value["mode"].raw != HOME:
            self.found = 0

    def change(self, control: int) -> None:
        """Advances the state machine of CiA 402."""
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
        """Moves the motor to its target at once."""
        before = self.value["position"].raw
        if self.state == ENABLED and self.value["mode"].raw == 8:
            self.value["position"].raw = self.value["target"].raw
        self.value["velocity"].raw = self.value["position"].raw - before

    def fail(self, code: int) -> None:
        """Raises a fault and sends an emergency."""
        with self.lock:
            self.state = FAULT
            self.value["error"].raw = code
            self.node.emcy.send(code)

    def restart(self) -> None:
        """Restarts, as after a power failure."""
        with self.lock:
            self.state, self.syncs = OFF, 0
            self.node.nmt.stop_heartbeat()
            self.value["control"].raw = 0
            self.node.nmt.state = "PRE-OPERATIONAL"
            self.network.send_message(0x700 + self.id, [0])


class Module(Node):
    """CiA 401 module, whose terminals are its objects."""

    def __init__(self, channel: str, node: int) -> None:
        super().__init__(channel, node, terminals(node))

    def at(self, index: int, sub: int) -> int:
        """Returns the value of an entry of an object."""
        return self.node.sdo[index][sub].raw

    def put(self, index: int, sub: int, value: int) -> None:
        """Sets the value of a terminal."""
        self.node.sdo[index][sub].raw = value
