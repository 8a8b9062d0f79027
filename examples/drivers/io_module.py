# SPDX-License-Identifier: Apache-2.0
"""A driver in Python on top of a third-party library: a CiA 401 I/O module on CANopen, with `canopen` (pip install canopen).

`rtp.physical_device("io", gpac.drivers.python("examples/drivers/io_module.py", channel="can0"), exchange=slow)` opens one. Any bus
that python-can supports will do, including an adapter on a serial line: `interface="slcan", channel="/dev/ttyACM0"`.
"""

import canopen

from opengpac.driver import Driver, Option, read, service, write

# Entries of the object dictionary: eight inputs, eight outputs, an analog input and output (32767 is 10 V), the serial number.
INPUTS, OUTPUTS, ANALOG_IN, ANALOG_OUT, SERIAL, FULL = (0x6000, 1), (0x6200, 1), (0x6401, 1), (0x6411, 1), (0x1018, 4), 3276.7


class IoModule(Driver):
    """CiA 401 I/O module on CANopen."""

    channel: str = Option("the bus: can0, or the line of an adapter")
    interface: str = Option("what python-can calls its kind: socketcan, slcan, pcan", "socketcan")
    bitrate: int = Option("of the bus, bit/s", 250_000)
    node: int = Option("the number of the module, 1 to 127", 1)
    timeout: float = Option("how long it may take to answer", 1.0, unit="s")
    settle: float = Option("how long an adapter takes to begin, s", 0.0)

    inputs = read("uint8_t", doc="its inputs, a bit each")
    level = read("double", unit="V", doc="at its analog input")
    valve = write("bool", doc="its first output")
    voltage = write("double", unit="V", doc="at its analog output, -10 to 10", safe=0.0)

    def open(self) -> None:
        self.bus = canopen.Network()
        # Closing waits this long for the reading thread; the default is 1 s.
        self.bus.NOTIFIER_CYCLE = 0.02
        self.bus.connect(interface=self.interface, channel=self.channel, bitrate=self.bitrate, sleep_after_open=self.settle)
        self.module = self.bus.add_node(self.node, canopen.ObjectDictionary())
        self.module.sdo.RESPONSE_TIMEOUT = self.timeout
        self.module.nmt.send_command(1)
        self.module.sdo.upload(*INPUTS)

    def exchange(self) -> None:
        self.tell(self.valve, self.voltage)
        self.inputs = self.module.sdo.upload(*INPUTS)[0]
        self.level = int.from_bytes(self.module.sdo.upload(*ANALOG_IN), "little", signed=True) / FULL

    def safe_state(self) -> None:
        self.tell(False, 0.0)

    def close(self) -> None:
        self.bus.disconnect()

    @service
    def serial_number(self) -> int:
        """Reads the serial number of the module."""
        return int.from_bytes(self.module.sdo.upload(*SERIAL), "little")

    def tell(self, valve: bool, voltage: float) -> None:
        self.module.sdo.download(*OUTPUTS, bytes([valve]))
        self.module.sdo.download(*ANALOG_OUT, round(min(max(voltage, -10.0), 10.0) * FULL).to_bytes(2, "little", signed=True))
