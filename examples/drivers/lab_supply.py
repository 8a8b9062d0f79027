# SPDX-License-Identifier: Apache-2.0
"""A driver in Python: a bench power supply that speaks SCPI over TCP, usually at port 5025.

`rtp.physical_device("supply", gpac.drivers.python("examples/drivers/lab_supply.py", host="192.0.2.7"), exchange=slow)` opens one.
"""

import socket

from opengpac.driver import Driver, Option, read, write


class LabSupply(Driver):
    """Bench power supply over TCP."""

    host: str = Option("its address")
    port: int = Option("its port", 5025)
    timeout: float = Option("how long it may take to answer", 2.0, unit="s")
    current_max: float = Option("the limit of its current", 1.0, unit="A")

    voltage = read("double", unit="V", doc="measured at its clamps")
    current = read("double", unit="A", doc="measured")
    on = write("bool", doc="whether its output is on")
    target = write("double", unit="V", doc="what it is to hold", safe=0.0)

    def open(self) -> None:
        self.line = socket.create_connection((self.host, self.port), timeout=self.timeout)
        self.answers = self.line.makefile("r")
        self.told = {}
        self.tell("CURR", self.current_max)

    def exchange(self) -> None:
        self.tell("VOLT", self.target)
        self.tell("OUTP", int(self.on))
        self.voltage = float(self.ask("MEAS:VOLT?"))
        self.current = float(self.ask("MEAS:CURR?"))

    def safe_state(self) -> None:
        self.told = {}
        self.tell("OUTP", 0)

    def close(self) -> None:
        self.line.close()

    def tell(self, what: str, value: float) -> None:
        """Sends a setting if it has changed."""
        if self.told.get(what) != value:
            self.line.sendall(f"{what} {value:g}\n".encode())
            self.told[what] = value

    def ask(self, what: str) -> str:
        """Returns the answer to a query. Raises `ConnectionError` if the supply has closed the connection."""
        self.line.sendall(f"{what}\n".encode())
        if not (answer := self.answers.readline()):
            raise ConnectionError(f"the supply at {self.host} has closed the connection")
        return answer
