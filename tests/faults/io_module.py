# SPDX-License-Identifier: Apache-2.0
"""The conformance kit on `examples/drivers/io_module.py`, against a module that the package `canopen` simulates behind an adapter.

python tests/faults/io_module.py a minute of processor time: make faults
"""

from __future__ import annotations

import sys
from pathlib import Path

TESTS = Path(__file__).parents[1]
sys.path.insert(0, str(TESTS / "python"))

from kit_of_drivers import checked  # noqa: E402
from slcan_peer import Adapter  # noqa: E402


def main() -> int:
    driver = TESTS.parent / "examples" / "drivers" / "io_module.py"
    with Adapter(node=7) as adapter:
        print(checked(str(driver), "interface=slcan", f"channel={adapter.port}", "node=7"), end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
