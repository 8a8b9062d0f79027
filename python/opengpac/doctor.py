# SPDX-License-Identifier: Apache-2.0
"""The command `opengpac doctor`: reports the real-time capability of this machine, recommended changes, and the latency of its timers."""

from __future__ import annotations

import argparse
import dataclasses
import json
import os
import platform
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from .system.system import System

_STEP_S = 0.25
_PRIORITY = 80
_LATE_NS = 100_000
"""Lateness, in ns, that is noticeable for a servo at 1 kHz: a tenth of the period."""
_IDLE_US = 50
"""Exit latency above which an idle state disturbs a source at 1 kHz."""
_SHARED_MIN = 256 << 20


@dataclass(frozen=True)
class Finding:
    """Finding about one aspect of the machine, with the recommended change."""

    state: Literal["ok", "better", "missing"]
    """Severity: `missing` means a privilege or feature is missing, so that sources run late; `better` means that it works, but could be
    improved."""
    what: str
    found: str
    change: str = ""
    """Recommended change; empty if none is needed."""

    def __str__(self) -> str:
        line = f"{self.state:<8}{self.what:<20}{self.found}"
        return f"{line}\n{'':<28}-> {self.change}" if self.change else line


@dataclass(frozen=True)
class Latency:
    """Lateness of a 1 ms timer relative to its release times."""

    core: int | None
    """Core of a pinned processor, whose timers sleep until shortly before a release time and then spin; None for an unpinned processor,
    whose timers only sleep."""
    firings: int
    median_us: float
    """Median lateness, from a histogram with bins at powers of two."""
    worst_us: float
    overruns: int
    """Number of skipped releases."""

    def __str__(self) -> str:
        where = "not pinned" if self.core is None else f"core {self.core}"
        late = f"median {self.median_us:>8.1f} us   worst {self.worst_us:>8.1f} us"
        return f"{where:<12}{self.firings:>8} firings   {late}   {self.overruns} overruns"


@dataclass(frozen=True)
class Examination:
    """Results of `opengpac doctor` for a machine."""

    findings: tuple[Finding, ...]
    latencies: tuple[Latency, ...] = ()

    @property
    def fit(self) -> bool:
        """True if no finding is `missing`."""
        return all(finding.state != "missing" for finding in self.findings)

    def __str__(self) -> str:
        lines = [str(finding) for finding in self.findings]
        if self.latencies:
            lines += ["", f"Lateness of a 1 ms timer at priority {_PRIORITY}:", *map(str, self.latencies)]
        missing = [finding.what for finding in self.findings if finding.state == "missing"]
        better = sum(finding.state == "better" for finding in self.findings)
        end = f"missing: {', '.join(missing)}" if missing else "nothing is missing"
        return "\n".join([*lines, "", f"{end}; {better} could be better"])


def examine(seconds: float = 2.0, root: str | Path = "/", tell: Callable[[str], None] | None = None) -> Examination:
    """Inspects the machine, and measures the lateness of its timers for `seconds`: first one timer on each core that this process may
    use, then an unpinned timer for the same time. If `seconds` is 0, measures nothing and reports nothing about privileges.

    `root` is the location of `/proc` and `/sys`. `tell` is called periodically with a progress message.
    >>> print(examine(seconds=0).findings[0].what)
    kernel
    """
    findings = list(_looked_at(Path(root)))
    if seconds <= 0:
        return Examination(tuple(findings))
    latencies, missing = _measured(seconds, tell or (lambda line: None))
    findings += [Finding("missing", "rights", line) for line in missing] or [Finding("ok", "rights", "priority and locked memory granted")]
    late = [latency for latency in latencies if latency.overruns or latency.worst_us * 1e3 > _LATE_NS]
    if late:
        worst = max(late, key=lambda latency: latency.worst_us)
        change = "end other programs, follow the lines above one by one, and measure for longer: opengpac doctor --seconds 60"
        findings.append(
            Finding("better", "latency", f"up to {worst.worst_us:.0f} us, {sum(latency.overruns for latency in late)} overruns", change)
        )
    else:
        findings.append(Finding("ok", "latency", f"at most {max(latency.worst_us for latency in latencies):.0f} us"))
    return Examination(tuple(findings), tuple(latencies))


def _looked_at(root: Path) -> Iterator[Finding]:
    """Yields the findings based on information from the operating system; none if it is unavailable."""
    cpus = root / "sys/devices/system/cpu"
    yield _kernel(root)
    yield from _governors(cpus)
    yield from _idle_states(cpus)
    yield from _isolation(cpus)
    yield from _clock(root)
    yield from _throttling(root)
    yield from _shared_memory(root)
    yield from _virtual_machine(root)


def _text(path: Path) -> str | None:
    try:
        return path.read_text().strip()
    except OSError:
        return None


def _kernel(root: Path) -> Finding:
    version = _text(root / "proc/version") or platform.version()
    release = version.split()[2] if version.startswith("Linux version ") else platform.release()
    if _text(root / "sys/kernel/realtime") == "1" or "PREEMPT_RT" in version:
        return Finding("ok", "kernel", f"{release}, fully preemptible (PREEMPT_RT)")
    change = (
        "install a kernel with PREEMPT_RT, which wakes sources within tens of microseconds: on Debian, apt install linux-image-rt-amd64"
    )
    return Finding("better", "kernel", f"{release}, not fully preemptible", change)


def _governors(cpus: Path) -> Iterator[Finding]:
    found = {text for path in cpus.glob("cpu[0-9]*/cpufreq/scaling_governor") if (text := _text(path))}
    if found == {"performance"}:
        yield Finding("ok", "frequency governor", "performance")
    elif found:
        change = "fix the frequency, since cores that change it start slowly: cpupower frequency-set -g performance"
        yield Finding("better", "frequency governor", ", ".join(sorted(found)), change)


def _idle_states(cpus: Path) -> Iterator[Finding]:
    slow: dict[str, int] = {}
    states = [path.parent for path in cpus.glob("cpu[0-9]*/cpuidle/state*/latency")]
    for state in states:
        latency = int(_text(state / "latency") or 0)
        if latency > _IDLE_US and _text(state / "disable") == "0":
            slow[_text(state / "name") or state.name] = latency
    if slow:
        shown = ", ".join(f"{name} ({latency} us to leave)" for name, latency in sorted(slow.items(), key=lambda entry: entry[1]))
        yield Finding("better", "idle states", shown, f"disable those that take longer to leave: cpupower idle-set -D {_IDLE_US}")
    elif states:
        yield Finding("ok", "idle states", f"none takes more than {_IDLE_US} us to leave")


def _isolation(cpus: Path) -> Iterator[Finding]:
    present = _text(cpus / "present")
    if present is None:
        return
    if present == "0":
        yield Finding("better", "cores", "one", "use a machine with several cores: sources of low priority wait for all others")
        return
    isolated = _text(cpus / "isolated")
    if isolated:
        yield Finding("ok", "isolated cores", f"{isolated}; use them for fast processors: cell.processor('fast', core=...)")
    else:
        change = (
            "reserve a core for a fast processor: isolcpus=N nohz_full=N on the kernel's command line, and cell.processor('fast', core=N)"
        )
        yield Finding("better", "isolated cores", "none", change)
    if _text(cpus / "smt/active") == "1":
        change = (
            "put nosmt on the kernel's command line, or leave the sibling of a fast core free: two threads of one core delay each other"
        )
        yield Finding("better", "hyper-threading", "on", change)


def _clock(root: Path) -> Iterator[Finding]:
    clock = _text(root / "sys/devices/system/clocksource/clocksource0/current_clocksource")
    if clock in ("hpet", "acpi_pm", "jiffies", "refined-jiffies"):
        change = "see in dmesg why the kernel does not use tsc: this clock is slow or coarse"
        yield Finding("better", "clock", clock, change)
    elif clock:
        yield Finding("ok", "clock", clock)


def _throttling(root: Path) -> Iterator[Finding]:
    runtime, period = (_text(root / "proc/sys/kernel" / f"sched_rt_{name}_us") for name in ("runtime", "period"))
    if runtime is None or period is None or int(period) == 0:
        return
    if int(runtime) < 0:
        yield Finding("ok", "throttling", "real-time threads may use all the time of a core")
    else:
        share = 100 * int(runtime) / int(period)
        yield Finding("ok", "throttling", f"real-time threads together may use {share:.0f} % of a core in {int(period) / 1e6:g} s")


def _shared_memory(root: Path) -> Iterator[Finding]:
    try:
        place = os.statvfs(root / "dev/shm")
    except OSError:
        yield Finding("missing", "shared memory", "/dev/shm does not exist", "mount a tmpfs there: connections between processes use it")
        return
    free = place.f_bavail * place.f_frsize
    if free < _SHARED_MIN:
        change = "enlarge it, mount -o remount,size=1G /dev/shm, or delete stale files in it: connections between processes use it"
        yield Finding("better", "shared memory", f"{free >> 20} MiB free in /dev/shm", change)
    else:
        yield Finding("ok", "shared memory", f"{free >> 20} MiB free in /dev/shm")


def _virtual_machine(root: Path) -> Iterator[Finding]:
    flags = next((line for line in (_text(root / "proc/cpuinfo") or "").splitlines() if line.startswith("flags")), "")
    if "hypervisor" in flags.split():
        change = "run machines on physical hardware: the host of a virtual machine may take cores away at any time"
        yield Finding("better", "machine", "virtual", change)


def _measured(seconds: float, tell: Callable[[str], None]) -> tuple[list[Latency], list[str]]:
    """Measures a timer on each core, all at once, then an unpinned one; also returns the privileges that were denied."""
    cores: list[int | None] = [*sorted(os.sched_getaffinity(0))]
    latencies: list[Latency] = []
    missing: dict[str, None] = {}
    for beside_each_other in (cores, [None]):
        with System("doctor", progress=False) as cell:
            for core in beside_each_other:
                name = "free" if core is None else f"core{core}"
                cell.processor(name, core=core).timer("timer", period="1 ms", priority=_PRIORITY)
            end = time.monotonic() + seconds
            while (left := end - time.monotonic()) > 0:
                tell(f"measuring, {left:.0f} s left")
                time.sleep(min(_STEP_S, left))
            sources = cell.statistics["sources"]
        for core, timing in zip(beside_each_other, sources.values(), strict=False):
            latencies.append(
                Latency(core, timing["firings"], timing["jitter_median_ns"] / 1e3, timing["jitter_max_ns"] / 1e3, timing["overruns"])
            )
            missing |= dict.fromkeys(timing["rights_missing"])
    return latencies, list(missing)


def add_to(commands: Any) -> None:
    """Adds the command to the parser."""
    doctor = commands.add_parser("doctor", help="check whether this machine is fit for real time, and what to change")
    doctor.add_argument("--seconds", type=float, default=2.0, help="duration of each of the two measurements; 0 for none (default: 2)")
    doctor.add_argument("--json", action="store_true", help="print the report as JSON")
    doctor.set_defaults(run=_doctor)


def _doctor(given: argparse.Namespace) -> int:
    shows = sys.stderr.isatty()

    def tell(line: str) -> None:
        if shows:
            print(f"\r{line:<30}", end="", file=sys.stderr, flush=True)

    try:
        found = examine(given.seconds, tell=tell)
    except KeyboardInterrupt:
        print("\ninterrupted; skip the measurement with opengpac doctor --seconds 0", file=sys.stderr)
        return 130
    if shows:
        print(f"\r{'':<30}\r", end="", file=sys.stderr)
    print(json.dumps(dataclasses.asdict(found), indent=2) if given.json else found)
    return 0 if found.fit else 1
