// SPDX-License-Identifier: Apache-2.0
//! An emulated segment on an interface: `echo '{"interface": "veth1", "drives": [{"name": "x"}]}' | cat - /dev/tty | cargo run --example segment`.
fn main() -> Result<(), String> {
    ethercat::emulator::run()
}
