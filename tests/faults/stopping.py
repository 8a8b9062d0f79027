# SPDX-License-Identifier: Apache-2.0
"""Stops under hostile connections: `stopping.py [--stops N] [--hostile N] [--seed N]`.

A daemon in real time runs a block, and a panel stops it, on kept connections and on new ones, while the requested number of
connections are idle, slow, send garbage, wait, read histories, request checks of definitions, and subscribe to scopes without
reading. No stop may fail, the daemon may use 256 MB, and a revoked token is locked out within 2 s. The times are reported, with the
lateness of a thread of this machine at the same time.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import random
import re
import secrets
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from panel import Panel

HERE = Path(__file__).parent
MEMORY_MAX_MB = 256.0
OUT_MAX_S = 2.0
ROLES = {"setup": "download", "panel": "operate", "first": "observe", "second": "observe", "gone": "observe"}
VERBS = ("emergency_stop", "halt", "disable", "pause")


@dataclass
class Found:
    """Results of a campaign."""

    times_ms: dict[str, list[float]] = field(default_factory=dict)
    """Time from the sending of a stop (on a new connection: from before it is opened) to its answer."""
    late_ms: list[float] = field(default_factory=list)
    """Lateness of a thread that slept for 1 ms."""
    memory_mb: float = 0.0
    descriptors: int = 0
    threads: int = 0
    out_s: float | None = None
    """Time from a token's revocation to the end of its stream."""
    hostile: dict[str, int] = field(default_factory=dict)
    wrong: list[str] = field(default_factory=list)

    def summary(self) -> str:
        """Returns all results, a line each."""
        lines = [f"{name:28} {told(times)}" for name, times in sorted(self.times_ms.items())]
        lines += [f"{'(wake-ups of this machine)':28} {told(self.late_ms)}"]
        lines += [f"daemon: at most {self.memory_mb:.0f} MB, {self.descriptors} descriptors, {self.threads} threads"]
        lines += [f"revoked token: out after {self.out_s} s", f"hostile: {self.hostile}"]
        return "\n".join(lines + [f"WRONG: {wrong}" for wrong in self.wrong])


def told(times_ms: list[float]) -> str:
    """Returns percentiles of times as text."""
    if not times_ms:
        return "none"
    ordered = sorted(times_ms)
    at = {share: ordered[min(int(share / 100 * len(ordered)), len(ordered) - 1)] for share in (50, 99, 99.9)}
    shares = ", ".join(f"{share} % {value:.2f}" for share, value in at.items())
    return f"{len(ordered):6} times, ms: {shares}, most {ordered[-1]:.2f}"


def keep(file: Path, tokens: dict[str, str], revoked: str = "") -> None:
    """Writes a file of tokens, as `opengpac token` does: a new file replaces the old one."""
    entries: list[dict[str, Any]] = []
    for name, token in tokens.items():
        sha256 = hashlib.sha256(token.encode()).hexdigest()
        entries.append({"name": name, "role": ROLES[name], "sha256": sha256, "created": 1, "revoked": 2 if name == revoked else None})
    new = file.with_suffix(".new")
    new.touch(0o600)
    new.write_text(json.dumps({"tokens": entries}))
    new.rename(file)


@contextmanager
def served(folder: Path) -> Iterator[tuple[subprocess.Popen[str], int, dict[str, str]]]:
    """Yields a daemon with a port, and a token for each caller."""
    tokens = {name: f"gpac_{secrets.token_urlsafe(32)}" for name in ROLES}
    keep(folder / "tokens.json", tokens)
    words = ["rts", "--name", "stopping", "--socket", str(folder / "s"), "--clock", "monotonic", "--listen", "127.0.0.1:0"]
    daemon = subprocess.Popen(
        [sys.executable, "-m", "opengpac", *words, "--tokens", str(folder / "tokens.json")],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    try:
        assert daemon.stdout is not None
        while not (found := re.match(r"listening on http://127\.0\.0\.1:(\d+)", line := daemon.stdout.readline())):
            assert line, "the daemon does not say where it listens"
        yield daemon, int(found[1]), tokens
    finally:
        daemon.send_signal(signal.SIGTERM)
        try:
            daemon.communicate(timeout=60)
        except subprocess.TimeoutExpired:
            daemon.kill()
            daemon.communicate()
            raise


def build(setup: Panel) -> int:
    """Builds a block that runs indefinitely, with a history, and a device; returns the running instance."""
    wave = {"wave": {"block": {"subroutine": "library.signal_generator"}, "constants": {"shape": 0, "offset": 2.5}}}
    runs = {"start": {"commands": [{"command": "activate", "block": "wave", "every_ns": 1_000_000}]}}
    setup.must("processor", name="rtp0")
    setup.must("source", processor="rtp0", name="fast", kind="timer", period_ns=1_000_000, priority=80)
    for name in ("y", "z"):
        setup.must("svv", name=name, type_text="double", history=10_000)
    setup.must("define_verb", name="wave", blocks=wave, instantiation_parameters={"y": ["wave.y"]}, command_lists=runs)
    setup.must("define_device_type", name="lamp", verb="wave", svvs={"y": {"type_text": "double"}}, parameters={})
    setup.must("device", name="red", device_type="lamp", source="rtp0.fast")
    observed = setup.must("create", verb="wave", arguments={"y": {"svv": "y"}}, placement={"*": "rtp0.fast"})
    setup.must("start", instance=observed)
    return observed


class Stops:
    """Panel that starts an instance, stops it, and measures the time."""

    def __init__(self, port: int, token: str, found: Found) -> None:
        self.port, self.token, self.found = port, token, found
        self.kept = Panel(port, token)
        self.session = self.kept.commander("panel")
        self.instance = self.kept.must("create", verb="wave", arguments={"y": {"svv": "z"}}, placement={"*": "rtp0.fast"})

    def stop(self, verb: str, observed: int, *, anew: bool) -> None:
        """Makes one stop, from running to running."""
        self._run(observed)
        arguments: dict[str, dict[str, Any]] = {
            "emergency_stop": {"reason": "tried"}, "halt": {"instance": self.instance}, "disable": {"name": "red"}, "pause": {},
        }  # fmt: skip
        begun = time.perf_counter()
        panel = Panel(self.port, self.token, self.session) if anew else self.kept
        status, answer = panel.call(verb, **arguments[verb])
        took_ms = (time.perf_counter() - begun) * 1e3
        self.found.times_ms.setdefault(f"{verb}, {'new' if anew else 'kept'} connection", []).append(took_ms)
        if status != 200:
            self.found.wrong.append(f"{verb} was answered with {status}: {answer}")
        if anew:
            panel.close()
        self._again(verb)

    def _run(self, observed: int) -> None:
        for instance in (observed, self.instance):
            if self.kept.must("state", instance=instance) != "running":
                self.kept.must("start", instance=instance)
        if self.kept.must("device_state", name="red") == "disabled":
            self.kept.must("enable", name="red")
            self.kept.to_its_end("wait_enabled", name="red")

    def _again(self, verb: str) -> None:
        if verb == "emergency_stop":
            while self.kept.call("reset")[0] != 200:
                time.sleep(0.001)
        elif verb == "pause":
            self.kept.must("resume_program")


def watched(daemon: subprocess.Popen[str], found: Found, over: threading.Event) -> None:
    """Monitors the daemon's memory and the machine's lateness until `over` is set."""
    folder = Path(f"/proc/{daemon.pid}")
    while not over.is_set():
        begun = time.perf_counter()
        time.sleep(0.001)
        found.late_ms.append((time.perf_counter() - begun) * 1e3 - 1.0)
        if len(found.late_ms) % 100 == 0:
            status = dict(line.split(":", 1) for line in (folder / "status").read_text().splitlines())
            found.memory_mb = max(found.memory_mb, int(status["VmHWM"].split()[0]) / 1024)
            found.threads = max(found.threads, int(status["Threads"]))
            found.descriptors = max(found.descriptors, len(list((folder / "fd").iterdir())))


def revoked(port: int, tokens: dict[str, str], file: Path) -> float:
    """Revokes the token of a stream; returns how long the stream continues, s."""
    with closing(Panel(port, tokens["gone"])) as panel:
        panel.stream()
        panel.say({"subscribe": "statistics", "id": "a", "every_ms": 100})
        panel.hear()
        keep(file, tokens, revoked="gone")
        return _closed(panel)


def _closed(panel: Panel) -> float:
    begun = time.perf_counter()
    while True:
        kind, content = panel.hear()
        if kind == 8:
            assert content == (4401).to_bytes(2, "big") + b"the token was revoked", content
            return round(time.perf_counter() - begun, 2)


def campaign(stops: int, hostile: int, seed: int, folder: Path) -> Found:
    """All of it."""
    found, chance, over = Found(), random.Random(seed), threading.Event()
    with served(folder) as (daemon, port, tokens):
        with closing(Panel(port, tokens["setup"])) as setup:
            setup.commander("setup")
            observed = build(setup)
            assert setup.ask("DELETE", "/v1/command")[0] == 200
        words = [sys.executable, str(HERE / "hostile.py"), str(port), str(observed), str(hostile), tokens["first"], tokens["second"]]
        enemies = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        watch = threading.Thread(target=watched, args=(daemon, found, over))
        try:
            assert enemies.stdout is not None and enemies.stdout.readline() == "ready\n"
            watch.start()
            panel = Stops(port, tokens["panel"], found)
            with closing(panel.kept):
                for number in range(stops):
                    panel.stop(chance.choice(VERBS), observed, anew=chance.random() < 0.5)
                    if number % 250 == 249:
                        print(f"{number + 1} stops, {found.memory_mb:.0f} MB", flush=True)
            found.out_s = revoked(port, tokens, folder / "tokens.json")
        except KeyboardInterrupt:
            print("interrupted", flush=True)
        finally:
            over.set()
            found.hostile = json.loads(enemies.communicate("")[0] or "{}")
            if watch.ident:
                watch.join()
    if found.memory_mb > MEMORY_MAX_MB:
        found.wrong.append(f"the daemon had {found.memory_mb:.0f} MB")
    return found


def main() -> None:
    """Runs the command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--stops", type=int, default=3_000)
    parser.add_argument("--hostile", type=int, default=64)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    with TemporaryDirectory() as folder:
        found = campaign(asked.stops, asked.hostile, asked.seed, Path(folder))
    print(found.summary())
    if found.out_s is not None and found.out_s > OUT_MAX_S:
        found.wrong.append("the revoked token was out too late")
    sys.exit(1 if found.wrong else 0)


if __name__ == "__main__":
    main()
