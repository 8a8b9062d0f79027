# SPDX-License-Identifier: Apache-2.0
"""Snapshot of a system's state, and the loads and rates between two snapshots."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

from ..errors import refusals
from ..system.realtime import RealTimeSystem


@dataclass(frozen=True)
class Look:
    """Snapshot of a system's state, as reported by the system."""

    statistics: Mapping[str, Any]
    configuration: Mapping[str, Any]
    alarms: list[Mapping[str, Any]]

    @classmethod
    def at(cls, system: RealTimeSystem) -> Self:
        """Takes a snapshot of the system."""
        alarms = system.alarms()["current"]
        return cls(system.statistics(), system.configuration(), alarms)

    def since(self, before: Look | None) -> float:
        """Returns the time on the system's clock between the previous snapshot and this one, s; if there is no previous snapshot, since
        the start."""
        return self.statistics["now_s"] - (before.statistics["now_s"] if before else 0.0)

    def sources(self, before: Look | None) -> list[dict[str, Any]]:
        """Returns the interrupt sources: `load` is the fraction of a core used by firings, 0 to 1, or None if no time has elapsed."""
        passed = self.since(before)
        found: list[dict[str, Any]] = []
        for name, s in self.statistics["sources"].items():
            about = self.configuration["sources"].get(name, {})
            last = before.statistics["sources"].get(name, {}) if before else {}
            kind = about.get("kind", "")
            period_ns = kind["timer"]["period_ns"] if isinstance(kind, dict) else None
            bins = [now - then for now, then in zip(s["jitter_bins"], last.get("jitter_bins", [0] * 32), strict=True)]
            found.append(
                {
                    "name": name, "processor": about.get("processor", ""), "kind": "timer" if period_ns else kind, "period_ns": period_ns,
                    "priority": about.get("priority"),
                    "load": _rate(s["duration_sum_ns"] * 1e-9, last.get("duration_sum_ns", 0) * 1e-9, passed),
                    "firings_per_s": _rate(s["firings"], last.get("firings", 0), passed),
                    "jitter_median_ns": min(_median(bins), s["jitter_max_ns"]), "jitter_max_ns": s["jitter_max_ns"],
                    "duration_max_ns": s["duration_max_ns"], "overruns": s["overruns"], "late": s["late"], "faults": s["faults"],
                    "stopped": s["stopped"], "rights_missing": s["rights_missing"], "steps": s["steps"],
                }
            )  # fmt: skip
        return found

    def processors(self, before: Look | None) -> list[dict[str, Any]]:
        """Returns the processors, each with the total load of its sources."""
        sources = self.sources(before)
        found: list[dict[str, Any]] = []
        for name, about in self.configuration["processors"].items():
            own = [s for s in sources if s["processor"] == name]
            loads = [s["load"] for s in own if s["load"] is not None]
            missing = [*dict.fromkeys(right for s in own for right in s["rights_missing"])]
            found.append(
                {
                    "name": name, "core": about.get("core"), "supervisor": about.get("supervisor", False), "sources": len(own),
                    "load": sum(loads) if loads else None, "rights_missing": missing,
                }
            )  # fmt: skip
        return found

    def blocks(self, before: Look | None) -> list[dict[str, Any]]:
        """Returns the blocks that a probe has measured; `used` is the fraction of a core, computed from their mean time and their rate."""
        passed = self.since(before)
        last = before._visited() if before else {}
        found: list[dict[str, Any]] = []
        for (source, instance, label), b in self._visited().items():
            then = last.get((source, instance, label), {"samples": 0, "mean_ns": 0.0, "number": 0})
            samples = b["samples"] - then["samples"]
            sum_ns = b["samples"] * b["mean_ns"] - then["samples"] * then["mean_ns"]
            mean_ns = sum_ns / samples if samples > 0 else b["mean_ns"]
            ran = _rate(b["number"], then["number"], passed) if b["number"] >= then["number"] and before else None
            used = None if ran is None else mean_ns * 1e-9 * ran
            found.append({**b, "source": source, "mean_ns": mean_ns, "invocations_per_s": ran, "used": used})
        return found

    def _visited(self) -> dict[tuple[str, str, str], dict[str, Any]]:
        return {(name, b["instance"], b["label"]): b for name, s in self.statistics["sources"].items() for b in s.get("blocks", [])}

    def json(self, before: Look | None) -> dict[str, Any]:
        """Returns all data, for `opengpac top --json`."""
        s = self.statistics
        return {
            "now_s": s["now_s"], "mode": s["mode"], "paused": s["paused"], "emergency": s["emergency"],
            "processors": self.processors(before), "sources": self.sources(before), "blocks": self.blocks(before),
            "instances": s["instances"], "devices": s["devices"], "physical_devices": s["physical_devices"], "alarms": self.alarms,
        }  # fmt: skip


class Watch:
    """Takes repeated snapshots, and keeps the probe of block times running in between."""

    def __init__(self, system: RealTimeSystem, every_s: float, probe: bool = True) -> None:
        self.every_s = every_s
        self._system = system
        self._probe = probe
        self._last: Look | None = None

    def look(self) -> tuple[Look, Look | None]:
        """Takes a snapshot, and returns it together with the previous one."""
        with refusals:
            if self._probe:
                # The probe ends by itself when it is no longer renewed.
                self._system.probe(round(max(5.0, 3 * self.every_s) * 1e9))
            before, self._last = self._last, Look.at(self._system)
        return self._last, before


def _rate(now: float, then: float, passed: float) -> float | None:
    """Returns the rate per second, or None if no time has elapsed or the counter was reset."""
    return (now - then) / passed if passed > 0 and now >= then else None


def _median(bins: list[int]) -> int:
    """Returns the upper edge of the bin that contains the median."""
    half, seen = (sum(bins) + 1) // 2, 0
    for number, count in enumerate(bins):
        seen += count
        if seen >= half > 0:
            return 1 << (number + 1)
    return 0
