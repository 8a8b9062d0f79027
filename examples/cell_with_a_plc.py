# SPDX-License-Identifier: Apache-2.0
"""A cell with a PLC: an arm, a conveyor on EtherCAT, a scanner on a serial line, and the line's PLC on Modbus.

The PLC requests a part. The conveyor brings it, the scanner reads its code, the arm puts it away if the code is one of ours, and the
result is reported to the PLC. All this is one verb, whose transitions the real-time system makes by itself. The emergency stop chain
is read from the PLC, too.

The example emulates the PLC, the scanner and the drives; `--driver ur` commands the arm over its own protocol. The run is recorded
and replayed from the record. The exit code is 0 only if everything went as expected.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import opengpac as gpac
import programs
from opengpac import activate, motion, on
from opengpac.cell import DigitalInput, DigitalOutput, pulse, wait_for_input
from opengpac.drivers import fake
from opengpac.robots import Arm, Joint
from programs import BLOCKS, Account, Trace

PITCH = 0.25
"""Distance between parts on the conveyor, m."""
HOME, BELT, BOX = gpac.deg([0, -90, 90, -90, -90, 0]), gpac.deg([30, -70, 100, -120, -90, 0]), gpac.deg([-40, -75, 95, -110, -90, 0])
"""Poses in which the arm waits, takes a part and puts it down."""

# Addresses of the PLC's signals: discrete inputs and coils of its Modbus tables.
SIGNALS = {
    "wanted": {"discrete": 0},
    "chain": {"discrete": 1},
    "delivered": {"coil": 0, "write": True},
    "rejected": {"coil": 1, "write": True},
}


@dataclass(frozen=True)
class Counterparts:
    """Emulated counterparts of the cell. With real ones at the same addresses the rest of this program stays unchanged."""

    plc: fake.Modbus
    scanner: fake.Text
    drives: fake.EtherCatSegment


@contextmanager
def counterparts() -> Iterator[Counterparts]:
    """Starts the PLC, the scanner and the drives."""
    with fake.modbus() as plc, fake.text(serial=True, end="\r") as scanner, fake.ethercat("belt") as drives:
        for name, signal in SIGNALS.items():
            table = "coil" if "coil" in signal else "discrete"
            plc.put(table, signal[table], name == "chain")
        yield Counterparts(plc, scanner, drives)


class Line:
    """Hardware of the cell: physical devices, and the logical devices that verbs use."""

    def __init__(self, cell: gpac.System, there: Counterparts, driver: gpac.drivers.Driver | None = None) -> None:
        rtp = cell.processor("rtp0")
        fast, slow = rtp.timer("fast", period="1 ms", priority=80), rtp.timer("slow", period="10 ms", priority=60)
        # The drives are emulated by a program, which may be late; for real ones the defaults will do.
        axes = gpac.drivers.ethercat(
            there.drives.interface, {"belt": {"counts": 100_000, "unit": "m", "speed_max": 0.5}}, timeout="5 s", lost_after=4_000
        )
        drives = rtp.physical_device("drives", axes, exchange=fast)
        plc = rtp.physical_device(
            "plc", gpac.drivers.modbus(there.plc.address, channels=SIGNALS, answer="5 s", age_max="10 s"), exchange=slow
        )
        codes = gpac.drivers.text(there.scanner.address, end="\r", reads=["{code}"], fields={"code": {"text": 16}})
        self.scanner = rtp.physical_device("scanner", codes, exchange=slow)
        self.arm: Arm = gpac.robots.load("ur5e", on=fast, driver=driver)
        self.belt = Joint("belt", drive=drives["belt"])
        self.wanted = DigitalInput("wanted", plc["wanted"])
        self.delivered, self.rejected = DigitalOutput("delivered", plc["delivered"]), DigitalOutput("rejected", plc["rejected"])
        self.code = cell.svv("code", "uint8_t[16]")
        cell.emergency_stop_input(plc["chain"], trips=False)
        cell.place({"*": slow})

    def enable(self) -> None:
        """Enables all devices; nothing moves."""
        for device in (self.arm, self.belt, self.wanted, self.delivered, self.rejected):
            device.enable()


def deliver(next_code: gpac.Block) -> gpac.ComposedVerb:
    """Returns the program of the cell, run once for each part."""
    scan = gpac.Verb(
        "scan",
        doc="Waits for the next code of the scanner, and looks at its first letter.",
        blocks={"next": next_code},
        instantiation_parameters={"count": "next.count", "text": "next.text", "code": "next.code"},
        command_lists={"start": [activate("next", every="10 ms")]},
        conditions={"ours": on("next.ours", returns=[]), "foreign": on("next.foreign", returns=[])},
    )
    return gpac.compose(
        "deliver",
        {
            "ask": wait_for_input.verb(DigitalInput),
            "bring": motion.move_relative,
            "scan": scan,
            "take": motion.move_absolute,
            "put": motion.move_absolute,
            "leave": motion.move_absolute,
            "tell": pulse.verb(DigitalOutput),
            "refuse": pulse.verb(DigitalOutput),
        },
        transitions={
            ("ask", "came"): "bring",
            ("bring", "arrived"): "scan",
            ("scan", "ours"): "take",
            ("take", "arrived"): "put",
            ("put", "arrived"): "leave",
            ("leave", "arrived"): "tell",
            ("scan", "foreign"): "refuse",
        },
        rename={
            "ask.source": "wanted", "bring.*": "belt_*", "bring.arm": "belt", "bring.goal": "pitch",
            "take.goal": "belt_place", "put.goal": "box", "leave.goal": "home",
            "tell.output": "delivered", "tell.over": "was_delivered", "refuse.output": "rejected", "refuse.over": "was_rejected",
        },
        doc="Brings a part when the PLC wants one, and puts it away if its code is one of ours.",
    )  # fmt: skip


def perform(cell: gpac.System, line: Line, there: Counterparts, account: Account) -> None:
    """Delivers parts: one of ours, a foreign one, one during which the emergency stop chain opens, and one more after the reset."""
    program = deliver(cell.download(BLOCKS / "next_code.c").next_code)
    print(program)
    objects = {"wanted": line.wanted, "belt": line.belt, "arm": line.arm, "delivered": line.delivered, "rejected": line.rejected}
    part = program.new_instance(**objects, count=line.scanner["count"], text=line.scanner["code"], code=line.code)

    def begin(code: str) -> None:
        """Starts the verb; then the PLC requests a part, and the conveyor carries it past the scanner."""
        begins = line.belt.sensed.value
        part.start(pitch=PITCH, belt_place=BELT, box=BOX, home=HOME, speed="60 %", belt_speed="100 %", width="0.1 s")
        there.plc.put("discrete", 0, True)
        wait_for_input(line.belt.sensed, above=begins + 0.5 * PITCH)
        there.plc.put("discrete", 0, False)
        there.scanner.say(code)

    for code, wanted in [("A-1042", "was_delivered"), ("C-0007", "was_rejected")]:
        account.begin(f"a part with the code {code}")
        begin(code)
        account.end(code, part.wait(), wanted, f", {bytes(line.code.value).rstrip(bytes(1)).decode()}")

    account.begin("a part of ours, and somebody opens the emergency stop chain while the arm moves")
    begin("A-1043")
    wait_for_input(line.arm.shoulder_pan.sensed, above=0.1)
    there.plc.put("discrete", 1, False)
    try:
        account.end("stopped", part.wait(), "emergency_stop")
    except gpac.Terminated as ended:
        account.end("stopped", ended.report, "emergency_stop")
    account.expect("the arm is disabled", all(joint.state == "disabled" for joint in line.arm))

    account.begin("the chain is closed, the cell reset and enabled, and the next part comes")
    there.plc.put("discrete", 1, True)
    cell.reset(within="10 s")
    line.enable()
    begin("A-1044")
    account.end("A-1044", part.wait(), "was_delivered")
    account.expect("the conveyor has brought four parts", abs(line.belt.sensed.value - 4 * PITCH) < 0.01, f"{line.belt.sensed.value:.3f} m")


def plot(record: Path, file: Path) -> None:
    """Plots the conveyor, the arm and the signals of the PLC over time."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    recorded = gpac.open_recording(record)
    rows = {
        "conveyor (m)": ["belt.sensed", "belt.commanded"],
        "arm (rad)": [name for name in recorded if name.startswith("ur5e.") and name.endswith(".sensed")],
        "PLC": ["wanted.value", "delivered.value", "rejected.value"],
    }
    figure, axes = plt.subplots(len(rows), 1, sharex=True, figsize=(10, 7), layout="constrained")
    for axis, (label, names) in zip(axes, rows.items(), strict=True):
        for name in names:
            values = recorded[name]
            axis.step(values["time"], values["value"].astype(float), where="post", linewidth=1, label=name)
        axis.set_ylabel(label)
        axis.legend(loc="upper left", fontsize="small")
    axes[-1].set_xlabel("time (s)")
    figure.savefig(file, dpi=120)


def main() -> int:
    """Runs the program; returns 0 if everything went as expected."""
    parser = programs.parser(__doc__)
    programs.add_driver(parser)
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    record = options.output / "cell_with_a_plc.mcap"
    record.unlink(missing_ok=True)
    account = Account()
    with counterparts() as there, programs.controller(options) as robot, programs.system("cell_with_a_plc", options) as cell:
        cell.record(record, replay=True)
        line = Line(cell, there, programs.commanding(robot))
        programs.studio(cell, options)
        line.enable()
        trace = Trace(line.belt.sensed, *(joint.sensed for joint in line.arm))
        perform(cell, line, there, account)
        trace.save(options.trace, every=0.05)
        counted = {device.name: device.counters for device in cell.physical_devices.values() if device.about.get("counters")}
    account.begin("the run once more, from its record")
    account.expect("the run replayed is the same, bit for bit", gpac.replay(record, trust=True).same)
    plot(record, options.output / "cell_with_a_plc.png")
    print(f"\nPositions and signals are drawn in {options.output / 'cell_with_a_plc.png'}\nWhat the drivers counted")
    for device, counters in counted.items():
        print(f"  {device:<10} {', '.join(f'{count} {name}' for name, count in counters.items() if count)}")
    return account.verdict()


if __name__ == "__main__":
    programs.run(main)
