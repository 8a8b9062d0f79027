# SPDX-License-Identifier: Apache-2.0
"""Fuzzes the parsers of external bytes, coverage-guided, each target of `crates/fuzz-targets` for the requested time.

    python tests/faults/fuzz.py                           ten minutes each
    python tests/faults/fuzz.py --seconds 60 --only types
    python tests/faults/fuzz.py --seconds 60 --keep       inputs that reach more code are put into the corpus

libFuzzer runs with the stable compiler: its instrumentation is a pass of LLVM. An input that fails is kept in `out/fuzz`.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent.parent
CORPUS = ROOT / "crates" / "fuzz-targets" / "corpus"
OUT = ROOT / "out" / "fuzz"
TRIPLE = "x86_64-unknown-linux-gnu"
LONGEST = 4096
"""Maximum size of an input in bytes."""

INSTRUMENTED = " ".join(
    [
        "-Cpasses=sancov-module",
        *(f"-Cllvm-args=-sanitizer-coverage-{what}" for what in ("level=4", "inline-8bit-counters", "pc-table", "trace-compares")),
        "--cfg fuzzing",
    ]
)


def built() -> Path:
    """Builds the instrumented program in a target folder of its own."""
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "fuzz"
    command = ["cargo", "build", "--release", "--quiet", "--target", TRIPLE, "--manifest-path", str(ROOT / "fuzz" / "Cargo.toml")]
    subprocess.run(command, check=True, env={**os.environ, "RUSTFLAGS": INSTRUMENTED, "CARGO_TARGET_DIR": str(target)})
    return target / TRIPLE / "release" / "fuzz"


def targets() -> list[str]:
    """Returns the names of the targets: each has a corpus."""
    return sorted(folder.name for folder in CORPUS.iterdir() if folder.is_dir())


def run(program: Path, target: str, seconds: int) -> tuple[bool, str]:
    """Fuzzes one target; returns whether it held, and libFuzzer's last lines."""
    grown, failed = OUT / target / "corpus", OUT / target / "failed"
    for folder in (grown, failed):
        folder.mkdir(parents=True, exist_ok=True)
    limits = [f"-max_total_time={seconds}", f"-max_len={LONGEST}", "-timeout=10", "-rss_limit_mb=4096", f"-artifact_prefix={failed}/"]
    command = [str(program), *limits, str(grown), str(CORPUS / target)]
    ended = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "FUZZ_TARGET": target})
    last = re.findall(r"^#\d+.*$|^Done .*$", ended.stderr, re.MULTILINE)[-2:]
    return ended.returncode == 0, " ".join(last) if ended.returncode == 0 else ended.stderr[-3000:]


def keep(program: Path, target: str) -> None:
    """Adds the inputs that reach new code to the corpus."""
    command = [str(program), "-merge=1", f"-max_len={LONGEST // 8}", str(CORPUS / target), str(OUT / target / "corpus")]
    subprocess.run(command, check=True, capture_output=True, env={**os.environ, "FUZZ_TARGET": target})


def main() -> int:
    parser = argparse.ArgumentParser(description="Fuzzes what reads bytes that others wrote.")
    parser.add_argument("--seconds", type=int, default=600, help="for each target")
    parser.add_argument("--only", default="", help="targets whose name contains this")
    parser.add_argument("--keep", action="store_true", help="let the corpus grow")
    options = parser.parse_args()
    program = built()
    held = True
    for target in targets():
        if options.only in target:
            good, words = run(program, target, options.seconds)
            held &= good
            print(f"{target}: {'held' if good else 'FAILED'}: {words}", flush=True)
            if good and options.keep:
                keep(program, target)
    return 0 if held else 1


if __name__ == "__main__":
    sys.exit(main())
