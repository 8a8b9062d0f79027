# SPDX-License-Identifier: Apache-2.0
"""`opengpac new driver`: creates a file, or a crate, with a working driver as a starting point."""

from __future__ import annotations

from pathlib import Path

C = """// SPDX-License-Identifier: Apache-2.0
#include <opengpac_driver.h>

struct {name} {{
    double gain, place, speed;
    int64_t at_ns;
    opengpac_slot position, velocity, bias, effort;
    uint64_t *exchanges;
}};

DRIVER({name}, "One axis that follows its effort, x' = gain u.",
    option_number(gain, 1.0, "speed at an effort of 1", "rad/s (0, 100]"),
    safe         ("it stops", 0, BY_DRIVER),
    counter      (exchanges, "readings so far"))

// Channels and parts, from the options. Nothing of the machine is touched.
const char *{name}_make(struct {name} *self, opengpac_host *host) {{
    self->gain = given_number(host, "gain");
    self->position = reads(host, "double", "axis.position", "position", "rad");
    self->velocity = reads(host, "double", "axis.velocity", "velocity", "rad/s");
    self->bias = reads(host, "double", "axis.bias", "effort that holds it: 0", "N.m");
    self->effort = writes(host, "double", "axis.effort", 0.0, "commanded effort", "N.m");
    part(host, (opengpac_part){{.name = "axis", .kp = 50.0}});
    self->exchanges = counter_of(host, "exchanges");
    return OK;
}}

// Once before the first exchange: connect to the machine here.
const char *{name}_open(struct {name} *self, int64_t now_ns) {{
    self->at_ns = now_ns;
    return OK;
}}

// At the start of each firing. Neither read nor write may allocate, lock or wait.
const char *{name}_read(struct {name} *self, int64_t release_ns, uint8_t *readings) {{
    self->place += self->speed * (double)(release_ns - self->at_ns) * 1e-9;
    self->at_ns = release_ns;
    set_number(readings, self->position, self->place);
    set_number(readings, self->velocity, self->speed);
    set_number(readings, self->bias, 0.0);
    count(self->exchanges, 1);
    return OK;
}}

// At the end of each firing.
const char *{name}_write(struct {name} *self, int64_t release_ns, const uint8_t *commands, const uint8_t *engaged) {{
    double effort = get_number(commands, self->effort);
    if (!__builtin_isfinite(effort)) return because("its effort at %lld ns is not finite", (long long)release_ns);
    self->speed = is_engaged(engaged, self->effort) ? self->gain * effort : 0.0;
    return OK;
}}

// After a fault, an emergency stop, at the end.
void {name}_safe_state(struct {name} *self) {{ self->speed = 0.0; }}
"""
"""Template of a driver in C: `C.format(name="axis")`."""

PYTHON = """# SPDX-License-Identifier: Apache-2.0
import math

from opengpac.driver import Driver, Option, counter, read, service, write


class {Name}(Driver):
    \"""An axis that moves at the commanded speed.\"""

    # Options, as set by a program: gpac.drivers.python("{name}.py", gain="2 rad/s", period="10 ms").
    gain: float = Option("speed at a command of 1", 1.0, unit="rad/s", within="(0, 100]")

    # Channels: exchange() sets the read channels, and finds the commands in the written ones.
    position = read("double", unit="rad", doc="position")
    speed = write("double", doc="commanded speed, -1 to 1", safe=0.0)
    exchanges = counter("exchanges so far")

    def open(self) -> None:
        # Called once before the first exchange: connect to the machine here. An exception is the reason that it cannot be opened.
        self.position = 0.0

    def exchange(self) -> None:
        # Called once a period. An exception loses the device.
        if not math.isfinite(self.speed):
            raise ValueError("its speed is not finite")
        self.exchanges += 1
        self.position += 0.01 * self.gain * self.speed

    def safe_state(self) -> None:
        # Called after a failure, when commands have stopped, and before close().
        self.speed = 0.0

    def close(self) -> None:
        # Disconnect here.
        pass

    @service
    def place(self, position: float = Option("position", unit="rad")) -> None:
        \"""Sets the position: device.services.place(position="90 deg").\"""
        self.position = position
"""
"""Template of a driver in Python: `PYTHON.format(name="axis", Name="Axis")`."""

_MANIFEST = """[package]
name = "{name}"
version = "0.1.0"
edition = "2024"
publish = false

[lib]
crate-type = ["cdylib"]

[workspace]
"""


def crate(name: str) -> dict[str, str]:
    """Returns the files of a crate with a driver in Rust, by path. The crate has no dependencies: all files but `lib.rs` are the
    interface."""
    sources = {path.name: path.read_text() for path in sorted((Path(__file__).parent / "rust").glob("*.rs"))}
    texts = {f"src/{file}": text.replace("{name}", name) if file == "lib.rs" else text for file, text in sources.items()}
    return {"Cargo.toml": _MANIFEST.format(name=name), **texts}
