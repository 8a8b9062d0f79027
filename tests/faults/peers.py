# SPDX-License-Identifier: Apache-2.0
"""A compromised processor: writes random data, a million times, into all memory that its process shares, and truncates it.

    python tests/faults/peers.py                          10^6 writes and truncations over 40 victims
    python tests/faults/peers.py --writes 50000 --seed 7  fewer

A victim is an application of three processors, two of them processes (`peers_victim.py`). The open memory of one of these processes
is written from here, as that process could do itself: bytes, words of notorious numbers, blocks of noise, mostly into the first words
of a memory; and every descriptor is truncated. No other process may end or hang: the supervisor answers, the other processors
continue their own work, and `close()` returns. It writes `out/peers.json`, and fails if any requirement did not hold. Ctrl-C ends it
with the results so far.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import mmap
import os
import random
import select
import struct
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
OUT = HERE.parent.parent / "out" / "peers.json"
WRITES = 1_000_000
VICTIMS = 40
HEADER = 448
SPECIAL = (0, 1, 2, 3, 4, 5, 6, 7, 255, 1023, 1024, 2**31, 2**32 - 1, 2**63, 2**64 - 2, 2**64 - 1)
ANSWER_S = 30.0
"""Time limit of the supervisor's answer; a safety net, not a measure."""


@dataclass
class Attack:
    """Damage to one victim, and its consequences."""

    seed: str
    writes: int = 0
    truncations: int = 0
    memories: int = 0
    unconnected: int = 0
    hostile_ended: bool = False
    close_s: float | None = None
    wrong: list[str] = field(default_factory=list)


class Victim:
    """Application in processes of its own."""

    def __init__(self) -> None:
        program = [sys.executable, str(HERE / "peers_victim.py")]
        self._process = subprocess.Popen(program, stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0)
        if self.hear() != "ready":
            self.end()
            raise RuntimeError("the victim does not start")

    def hear(self) -> str | None:
        """Returns the victim's next line; `None` if it sends none in time or has ended."""
        line = b""
        assert self._process.stdout is not None
        while not line.endswith(b"\n"):
            if not select.select([self._process.stdout], [], [], ANSWER_S)[0]:
                return None
            byte = self._process.stdout.read(1)
            if not byte:
                return None
            line += byte
        return line.decode().strip()

    def ask(self, what: str) -> dict[str, Any] | None:
        """Returns the victim's answer; `None` if it does not answer."""
        assert self._process.stdin is not None
        with contextlib.suppress(BrokenPipeError):
            self._process.stdin.write(f"{what}\n".encode())
        said = self.hear()
        return None if said is None else json.loads(said)

    def status(self) -> int | None:
        """Returns the exit status; `None` while the victim runs."""
        return self._process.poll()

    def processors(self) -> list[int]:
        """Returns the processes of the victim's processors, by number."""
        children = Path(f"/proc/{self._process.pid}/task").glob("*/children")
        pids = sorted({int(pid) for file in children for pid in file.read_text().split()})
        return [pid for pid in pids if b"processor" in Path(f"/proc/{pid}/cmdline").read_bytes()]

    def end(self) -> None:
        """Ends the victim, whatever its state."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(ANSWER_S)
        self._process.kill()
        self._process.wait()
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                stream.close()


def memories(pid: int) -> list[tuple[int, int]]:
    """Returns a descriptor of each memory that a process has open for others, with its size."""
    found: dict[tuple[int, int], tuple[int, int]] = {}
    for link in Path(f"/proc/{pid}/fd").iterdir():
        with contextlib.suppress(OSError):
            if any(mark in os.readlink(link) for mark in ("/memfd:opengpac", "/dev/shm/opengpac-")):
                descriptor = os.open(link, os.O_RDWR)
                about = os.fstat(descriptor)
                if (key := (about.st_dev, about.st_ino)) in found:
                    os.close(descriptor)
                else:
                    found[key] = (descriptor, about.st_size)
    return list(found.values())


def write(memory: mmap.mmap, rng: random.Random) -> None:
    """Writes once."""
    size = len(memory)
    at = rng.randrange(min(size, HEADER) if rng.random() < 0.7 else size)
    kind = rng.random()
    if kind < 0.4:
        memory[at] = rng.randrange(256)
    elif kind < 0.8 and size >= 8:
        at = min(at // 8 * 8, size // 8 * 8 - 8)
        memory[at : at + 8] = struct.pack("<Q", rng.choice(SPECIAL))
    else:
        noise = rng.randbytes(min(64, size - at))
        memory[at : at + len(noise)] = noise


def attack(seed: str, writes: int) -> Attack:
    """Attacks one victim."""
    done, rng = Attack(seed), random.Random(seed)
    victim = Victim()
    try:
        processors = victim.processors()
        hostile = rng.choice(processors)
        beside = "beside" if hostile == processors[0] else "hostile"
        present = memories(hostile)
        done.memories = len(present)
        for descriptor, size in present:
            for to in {0, size // 2, max(size - 1, 0)}:
                done.truncations += 1
                with contextlib.suppress(OSError):
                    os.ftruncate(descriptor, to)
        mapped = [mmap.mmap(descriptor, size) for descriptor, size in present if os.fstat(descriptor).st_size == size > 0]
        for number in range(writes):
            write(rng.choice(mapped), rng)
            done.writes += 1
            if number % 5000 == 0 and victim.status() is not None:
                break
        told = victim.ask("look")
        if told is None:
            done.wrong.append(f"the supervisor does not answer (status {victim.status()})")
        else:
            done.hostile_ended = not Path(f"/proc/{hostile}").exists()
            done.unconnected = len(told["unconnected"])
            done.wrong += [f"'{name}' stands still" for name in ("near", beside) if not told["moved"][name]]
        closed = victim.ask("close")
        if closed is None:
            done.wrong.append(f"close() does not return (status {victim.status()})")
        else:
            done.close_s = closed["close_s"]
        for memory in mapped:
            memory.close()
        for descriptor, _ in present:
            os.close(descriptor)
    finally:
        victim.end()
    return done


def main() -> int:
    """Runs the attacks; returns 0 if everything held."""
    parser = argparse.ArgumentParser(description="Writes over the memory that processes share.")
    parser.add_argument("--writes", type=int, default=WRITES)
    parser.add_argument("--victims", type=int, default=VICTIMS)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    done: list[Attack] = []
    with contextlib.suppress(KeyboardInterrupt):
        for number in range(options.victims):
            done.append(attack(f"{options.seed} {number}", -(-options.writes // options.victims)))
            one = done[-1]
            print(
                f"{number + 1} of {options.victims}: {one.writes} writes, {one.truncations} truncations of {one.memories} memories, "
                f"{one.unconnected} connections told as lost, close {one.close_s}: {'; '.join(one.wrong) or 'held'}",
                flush=True,
            )
    OUT.parent.mkdir(exist_ok=True)
    OUT.write_text(json.dumps([vars(one) for one in done], indent=1))
    wrong = [one for one in done if one.wrong]
    closes = sorted(one.close_s for one in done if one.close_s is not None)
    print(
        f"{sum(one.writes for one in done)} writes and {sum(one.truncations for one in done)} truncations: "
        f"{len(done) - len(wrong)} of {len(done)} victims held; close at most {max(closes, default=0.0):.1f} s"
    )
    return 1 if wrong or not done else 0


if __name__ == "__main__":
    sys.exit(main())
