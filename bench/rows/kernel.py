# SPDX-License-Identifier: Apache-2.0
"""Rows measured by the kernel's example `bench`, which is built here together with the loops and blocks in C."""

from __future__ import annotations

import functools
import json
import os
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

from lines import Line

ROOT = Path(__file__).resolve().parents[2]
C = ROOT / "bench" / "c"
# Flags of code modules, and of careful people compiling a loop that must give the same bits. The alignment of a function to 16 bytes
# depends on the code before it and decides a seventh of the loops over independent gains (1.94 or 1.70 ns).
FLAGS = ["-O2", "-fPIC", "-shared", "-ffp-contract=off", "-fno-fast-math", "-fno-math-errno", "-falign-functions=64"]


def measure(group: str, rounds: int, processes: int = 1) -> Iterator[Line]:
    """Yields the lines of one group. The addresses of code and memory vary by process, and matter for a loop of nanoseconds: of several
    processes each line is the one with the median value, for chains the worst."""
    if processes == 1:
        yield from _once(group, rounds)
        return
    for lines in zip(*[list(_once(group, rounds)) for _ in range(processes)], strict=True):
        ordered = sorted(lines, key=lambda line: line.value or 0.0)
        chain = "chain" in ordered[0].what and "recorded" not in ordered[0].what and "probe" not in ordered[0].what
        line = ordered[-1 if chain else processes // 2]
        if chain:
            line.note = f"of {processes} processes {', '.join(of.shown for of in ordered)}; {line.note}"
        yield line


def _once(group: str, rounds: int) -> Iterator[Line]:
    program, peer, blocks = built()
    yield from printed_by([program, peer, blocks, str(rounds), group], group)


def printed_by(command: list[str], group: str) -> Iterator[Line]:
    """Yields the lines that a program prints as JSON."""
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as running:
        assert running.stdout is not None
        for text in running.stdout:
            fields = json.loads(text)
            yield Line(**{**fields, "value": fields["value"] if fields["shown"] else None})
    if running.returncode:
        raise RuntimeError(f"the benchmark of {group} ended with {running.returncode}")


@functools.cache
def built() -> tuple[str, str, str]:
    """Builds the example, the loops and the blocks, and returns their paths."""
    folder = Path(tempfile.mkdtemp(prefix="opengpac-bench-"))
    peer, blocks = folder / "peer.so", folder / "blocks.so"
    compiler = os.environ.get("CC", "cc")
    subprocess.run([compiler, *FLAGS, C / "peer.c", "-o", peer, "-lm"], check=True)
    subprocess.run(
        [compiler, *FLAGS, "-fvisibility=hidden", "-I", ROOT / "crates/block/include", C / "blocks.c", "-o", blocks, "-lm"], check=True
    )
    return example("runtime", "bench"), str(peer), str(blocks)


def example(crate: str, name: str, *options: str) -> str:
    """Builds an example of a crate and returns its path; any profile but release only shows that it works. `OPENGPAC_EXAMPLES` is the
    folder in which `make test` has already built the examples, so that no test waits for a build."""
    if (there := Path(os.environ.get("OPENGPAC_EXAMPLES", os.devnull)) / name).exists():
        return str(there)
    profile = os.environ.get("OPENGPAC_BENCH_PROFILE", "release")
    # With the package each crate has the features with which it was built for the package: its dependencies are not rebuilt.
    beside = [] if profile == "release" else ["-p", "bindings", "--features", "bindings/hosts"]
    chosen = ["--profile", profile, "-p", crate, "--example", name, *beside, *options]
    command = ["cargo", "build", "--quiet", *chosen, "--message-format=json"]
    messages = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout
    artifacts = [json.loads(message) for message in messages.splitlines()]
    return next(a["executable"] for a in artifacts if a.get("target", {}).get("name") == name and a.get("executable"))
