# SPDX-License-Identifier: Apache-2.0
"""A driver in Python on top of a third-party library: a frequency inverter on Modbus TCP, with `pymodbus` (pip install pymodbus).

`rtp.physical_device("fan", gpac.drivers.python("examples/drivers/inverter.py", host="192.0.2.9"), exchange=slow)` opens one.
"""

from pymodbus.client import ModbusTcpClient
from pymodbus.exceptions import ModbusIOException

from opengpac.driver import Driver, Option, counter, read, service, write

# Holding registers: control word and requested frequency (0.01 Hz); status word, frequency (0.01 Hz), current (0.1 A).
COMMAND, STATUS, STOP, RUN, RESET, FAULT = 0, 16, 0, 1, 128, 8


class Inverter(Driver):
    """Frequency inverter on Modbus TCP."""

    host: str = Option("its address")
    port: int = Option("its port", 502)
    timeout: float = Option("how long it may take to answer; then it is asked again, twice", 1.0, unit="s")
    frequency = read("double", unit="Hz", doc="at its motor")
    current = read("double", unit="A", doc="of its motor")
    fault = read("bool", doc="it has switched itself off")
    run = write("bool", doc="whether its motor turns")
    wanted = write("double", unit="Hz", doc="the frequency that it is to have", safe=0.0)
    unanswered = counter("requests without an answer")

    def open(self) -> None:
        self.line = ModbusTcpClient(self.host, port=self.port, timeout=self.timeout, retries=2)
        assert self.line.connect(), f"no inverter answers at {self.host}:{self.port}"

    def exchange(self) -> None:
        self.tell(RUN if self.run else STOP, self.wanted)
        status, frequency, current = self.asked(self.line.read_holding_registers, STATUS, count=3).registers
        self.fault, self.frequency, self.current = bool(status & FAULT), frequency / 100, current / 10

    def safe_state(self) -> None:
        self.tell(STOP, 0.0)

    def close(self) -> None:
        self.line.close()

    @service
    def reset_fault(self) -> None:
        """Resets a fault of the inverter."""
        self.tell(RESET, 0.0)

    def tell(self, control: int, wanted: float) -> None:
        self.asked(self.line.write_registers, COMMAND, [control, min(max(round(wanted * 100), 0), 65535)])

    def asked(self, request, *words, **named):
        try:
            answer = request(*words, **named)
        except ModbusIOException:
            self.unanswered += 1
            raise
        if answer.isError():
            raise ConnectionError(f"the inverter at {self.host} refuses: {answer}")
        return answer
