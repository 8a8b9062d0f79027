# SPDX-License-Identifier: Apache-2.0
"""Statistics of a system, as dictionaries and lists displayed as tables."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..values.quantities import duration_text
from ..values.tables import Table, TableDisplay, Tables


def _time(ns: float) -> str:
    return duration_text(ns, digits=3)


def _median(source: Mapping[str, Any], what: str) -> str:
    """Returns the median from a histogram with bins at powers of two; the upper edge of a bin may exceed the maximum."""
    return _time(min(source[f"{what}_median_ns"], source[f"{what}_max_ns"]))


class Statistics(dict[str, Any], TableDisplay):
    """Statistics: firings, overruns, jitter and times of each source; instances; devices; the emergency stop."""

    def sources(self) -> Table:
        """Table of interrupt sources, with the number, lateness and duration of their firings."""
        rows = [
            (
                name, s["firings"], s["overruns"], s["late"], s["faults"], _median(s, "jitter"), _time(s["jitter_max_ns"]),
                _median(s, "duration"), _time(s["duration_max_ns"]), "; ".join(s["rights_missing"]) or "given",
            )
            for name, s in self["sources"].items()
        ]  # fmt: skip
        looks = ["bad" if s["stopped"] else "warn" if s["overruns"] or s["faults"] else "" for s in self["sources"].values()]
        head = ["source", "firings", "overruns", "late", "faults", "jitter median", "max", "firing median", "max", "real-time rights"]
        return Table("interrupt sources", head, rows, looks)

    def blocks(self, source: str | None = None) -> Table:
        """Returns the blocks that a probe has measured, sorted by their share of the time of their source's firings."""
        found = [(name, b) for name, s in self["sources"].items() for b in s.get("blocks", []) if source in (None, name)]
        found.sort(key=lambda entry: -entry[1]["mean_ns"])
        rows = [
            (
                f"{b['instance']}.{b['label']}", b["block"], name, _time(b["mean_ns"]), _time(b["max_ns"]), _time(b["last_ns"]),
                b["samples"],
            )
            for name, b in found
        ]  # fmt: skip
        return Table("block times", ["instance", "block", "source", "mean", "max", "last", "samples"], rows)

    def instances(self) -> Table:
        """Table of verb instances."""
        rows = [(i["name"], i["state"], i["list"], i["owner"] or "") for i in self["instances"]]
        looks = ["good" if i["state"] == "running" else "warn" if i["state"] == "suspended" else "" for i in self["instances"]]
        return Table("verb instances", ["instance", "state", "list", "supports"], rows, looks)

    def devices(self) -> Table:
        """Table of logical devices and of lost physical devices."""
        rows = [*self["devices"].items(), *((name, "lost") for name, p in self["physical_devices"].items() if p["lost"])]
        looks = ["bad" if state in ("fault", "lost") else "good" if state in ("standstill", "moving") else "soft" for _, state in rows]
        return Table("devices", ["device", "state"], rows, looks)

    def counters(self) -> Table:
        """Table of the counters of physical devices' drivers, for example of lost frames or late answers."""
        rows = [(name, *counter) for name, p in self["physical_devices"].items() for counter in p.get("counters", {}).items()]
        return Table("counters of drivers", ["device", "counter", "value"], rows)

    def _table(self) -> Tables:
        tables = [self.sources(), self.blocks(), self.instances(), self.devices(), self.counters()]
        head = f"emergency stop: {self['emergency']}" if self["emergency"] else f"{self['mode']} mode"
        return Tables([table for table in tables if table.rows], head + (", paused" if self["paused"] else ""))


class Names(dict[str, Any], TableDisplay):
    """Names of all objects in a system, grouped by kind."""

    def _table(self) -> Table:
        listed = {kind: [found] if isinstance(found, str) else found for kind, found in self.items() if found}
        rows = [(kind.replace("_", " "), ", ".join(_short(name) for name in found)) for kind, found in listed.items() if kind != "blocks"]
        return Table("", ["what", "names"], rows)


def _short(name: Any) -> str:
    return str(name.get("name", name)) if isinstance(name, Mapping) else str(name)


class FusedBlocks(dict[str, Any], TableDisplay):
    """Blocks that are fused, and those that are not, with the reason: see `System.fuse`.

    `on` indicates whether fusing is on; `waiting` is the number of groups that have not been compiled yet; `groups` contains for each
    group its `source`, its `blocks`, whether they are `fused`, and otherwise the reason, `why`; `single` contains each `block` that
    cannot be fused, and the reason, `why`.
    """

    def groups(self) -> Table:
        """Table of groups of blocks that are always due together, some of which read values that others store."""
        state = ["fused" if g["fused"] else g["why"] or "not fused" for g in self["groups"]]
        rows = [(g["source"], ", ".join(g["blocks"]), len(g["blocks"]), how) for g, how in zip(self["groups"], state, strict=True)]
        looks = ["good" if g["fused"] else "warn" if g["why"] else "" for g in self["groups"]]
        return Table("groups of blocks", ["source", "blocks", "number", "state"], rows, looks)

    def single(self) -> Table:
        """Table of blocks that cannot be fused."""
        return Table("blocks that cannot be fused", ["block", "why"], [(b["block"], b["why"]) for b in self["single"]])

    def _table(self) -> Tables:
        count = sum(len(g["blocks"]) for g in self["groups"] if g["fused"])
        head = f"{count} blocks are fused" if self["on"] else "blocks are not fused; fuse them with cell.fuse()"
        return Tables([table for table in (self.groups(), self.single()) if table.rows], head)


class Log(list[dict[str, Any]], TableDisplay):
    """Entries of a log, oldest first."""

    def _table(self) -> Table:
        rows = [(e["sequence"], f"{e['time_s']:.6f} s", e["kind"], e["about"], e["text"]) for e in self]
        looks = ["bad" if e["kind"] in ("fault", "emergency_stop") else "" for e in self]
        return Table("log", ["number", "time", "kind", "of", "what"], rows, looks)
