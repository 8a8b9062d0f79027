# SPDX-License-Identifier: Apache-2.0
"""Record = record = replay: every example is recorded twice, round after round, and replayed, bit for bit.

    python tests/faults/replays.py                                   a million firings of each example
    python tests/faults/replays.py --firings 50000 --programs guarded_move
    python tests/faults/replays.py --also target/checked/lib_native.so   also replayed by another build of the same sources

Under the virtual clock two records of one program have the same fingerprint: every input and every value. Each is replayed without
the program, by this build and by the other one. The report is in `out/replays.json`.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import opengpac

ROOT = Path(__file__).parent.parent.parent
OUT = ROOT / "out" / "replays.json"
PROGRAMS = ["coordinated_motion", "filtered_servo", "distributed_servo", "guarded_move", "compliant_motion", "centering_grasp"]
_AGAIN = """
import json, sys
import opengpac
for path in sys.argv[1:]:
    again = opengpac.replay(path, trust=True)
    same = again.same and again.stopped == "end"
    print(json.dumps({"firings": again.firings, "same": same, "fingerprint": again.fingerprint, "text": str(again)}))
"""


@dataclass
class Found:
    """Results of one program."""

    program: str
    rounds: int = 0
    firings: int = 0
    wrong: str = ""


def main() -> int:
    """Runs the command; returns 0 if every replay equalled its record, and all records of a round were the same."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--firings", type=int, default=1_000_000)
    parser.add_argument("--programs", nargs="+", choices=PROGRAMS, default=PROGRAMS)
    parser.add_argument("--also", type=Path, help="another build of the native module")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        packages = [Path(opengpac.__file__).parent.parent]
        if given.also is not None:
            packages.append(_package_with(given.also, Path(folder)))
        found = [_told(_program(program, given.firings, packages, Path(folder))) for program in given.programs]
    OUT.parent.mkdir(exist_ok=True)
    OUT.write_text(json.dumps([asdict(one) for one in found], indent=1))
    return 1 if any(one.wrong for one in found) else 0


def _told(one: Found) -> Found:
    print(f"{one.program:<20} {one.firings:>9,} firings in {one.rounds} rounds  {one.wrong or 'record = record = replay'}", flush=True)
    return one


def _package_with(native: Path, folder: Path) -> Path:
    """Copies the package with another native module."""
    package = folder / "other"
    shutil.copytree(Path(opengpac.__file__).parent, package / "opengpac", ignore=shutil.ignore_patterns("*.so", "__pycache__"))
    shutil.copy(native, package / "opengpac" / "_native.abi3.so")
    return package


def _program(program: str, firings: int, packages: list[Path], folder: Path) -> Found:
    found = Found(program)
    while found.firings < firings and not found.wrong:
        records = [_record(program, folder / f"{number}.mcap", packages[0]) for number in range(2)]
        agains = [again for package in packages for again in _again(records, package)]
        found.rounds += 1
        found.firings += agains[0]["firings"]
        wrong = [again["text"] for again in agains if not again["same"]]
        if wrong:
            found.wrong = wrong[0]
        elif len({again["fingerprint"] for again in agains}) != 1:
            found.wrong = f"the records of round {found.rounds} differ"
        elif agains[0]["firings"] == 0:
            found.wrong = "nothing was recorded"
    return found


def _record(program: str, path: Path, package: Path) -> Path:
    # A recording never overwrites another one.
    path.unlink(missing_ok=True)
    example = [str(ROOT / "examples" / f"{program}.py"), "--clock", "virtual", "--output", str(path.parent)]
    command = [sys.executable, "-m", "opengpac", "record", "-o", str(path), *example]
    done = subprocess.run(command, capture_output=True, text=True, env=_environment(package))
    if done.returncode:
        raise RuntimeError(f"'{program}' ended with {done.returncode}: {done.stderr}")
    return path


def _again(records: list[Path], package: Path) -> list[dict[str, Any]]:
    command = [sys.executable, "-c", _AGAIN, *map(str, records)]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, env=_environment(package))
    return [json.loads(line) for line in done.stdout.splitlines()]


def _environment(package: Path) -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(package)}


if __name__ == "__main__":
    sys.exit(main())
