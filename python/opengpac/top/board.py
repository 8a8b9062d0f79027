# SPDX-License-Identifier: Apache-2.0
"""Tables of `opengpac top`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from ..values.quantities import duration_text
from ..values.tables import Table, Tables
from .look import Look

ORDERS = ("time", "mean", "max", "name")
"""Sort orders of blocks: the fraction of a core that they use, or a column."""

_KEYS: dict[str, Callable[[dict[str, Any]], Any]] = {
    "time": lambda b: (-(b["used"] or 0.0), -b["mean_ns"]),
    "mean": lambda b: -b["mean_ns"],
    "max": lambda b: -b["max_ns"],
    "name": lambda b: (b["instance"], b["label"]),
}
_FULL, _BUSY = 0.9, 0.6
"""Fractions of a core above which a line is red or yellow, respectively."""


@dataclass
class View:
    """View of the tables: the order of the blocks, a text that lines must contain, and the number of lines available."""

    sort: str = ORDERS[0]
    filter: str = ""
    rows: int = 30

    def lets(self, *words: Any) -> bool:
        """Returns whether a line with these words passes the filter."""
        return not self.filter or any(self.filter.lower() in str(word).lower() for word in words)


def board(look: Look, before: Look | None, view: View | None = None) -> Tables:
    """Returns the tables of a snapshot; loads and rates refer to the time since the previous snapshot, or since the start."""
    view = view or View()
    first = [_processors(look, before, view), _sources(look, before, view)]
    others = [table for table in (_instances(look, view), _devices(look, view), _alarms(look, view)) if table.rows]
    # Blocks may be numerous: they get the lines left by the other tables.
    room = view.rows - sum(len(table.rows) + 4 for table in [*first, *others])
    blocks = _blocks(look, before, view, max(room - 4, 5))
    return Tables([table for table in [*first, blocks, *others] if table.rows], _head(look))


def _head(look: Look) -> str:
    s = look.statistics
    words = [f"{s['now_s']:.1f} s", f"{s['mode']} mode"]
    words += ["paused"] if s["paused"] else []
    words += [f"EMERGENCY STOP: {s['emergency']}"] if s["emergency"] else []
    return ", ".join(words)


def _share(share: float | None) -> str:
    if share is None:
        return "-"
    return f"{100 * share:.1f} %" if share >= 0.01 or share == 0 else f"{100 * share:.2g} %"


def _load_look(share: float | None) -> str:
    return "bad" if (share or 0) > _FULL else "warn" if (share or 0) > _BUSY else ""


def _rights(missing: Iterable[str]) -> str:
    return "; ".join(missing) or "given"


def _processors(look: Look, before: Look | None, view: View) -> Table:
    shown = [p for p in look.processors(before) if view.lets(p["name"])]
    rows = [
        (
            p["name"], "-" if p["core"] is None else p["core"], "supervisor" if p["supervisor"] else "", p["sources"], _share(p["load"]),
            _rights(p["rights_missing"]),
        )
        for p in shown
    ]  # fmt: skip
    looks = [_load_look(p["load"]) for p in shown]
    return Table("processors", ["processor", "core", "role", "sources", "load", "real-time rights"], rows, looks)


def _sources(look: Look, before: Look | None, view: View) -> Table:
    shown = [s for s in look.sources(before) if view.lets(s["name"])]
    rows = [
        (
            s["name"], s["kind"], duration_text(s["period_ns"]) if s["period_ns"] else "-", s["priority"], _share(s["load"]),
            "-" if s["firings_per_s"] is None else f"{s['firings_per_s']:.0f}", _time(s["jitter_median_ns"]), _time(s["jitter_max_ns"]),
            _time(s["duration_max_ns"]), s["overruns"], s["late"], s["faults"], "stopped by a fault" if s["stopped"] else "",
        )
        for s in shown
    ]  # fmt: skip
    looks = ["bad" if s["stopped"] else _load_look(s["load"]) for s in shown]
    head = ["source", "kind", "period", "priority", "load", "firings/s", "jitter median", "max", "longest firing"]
    head += ["overruns", "late", "faults", ""]
    return Table("interrupt sources", head, rows, looks)


def _blocks(look: Look, before: Look | None, view: View, most: int) -> Table:
    shown = [b for b in look.blocks(before) if view.lets(b["instance"], b["label"], b["block"], b["source"])]
    shown.sort(key=_KEYS[view.sort])
    rows = [
        (f"{b['instance']}.{b['label']}", b["block"], b["source"], _share(b["used"]), _time(b["mean_ns"]), _time(b["max_ns"]), b["samples"])
        for b in shown[:most]
    ]
    more = f", {most} of {len(shown)}" if len(shown) > most else ""
    return Table(f"blocks by {view.sort}{more}", ["instance", "block", "source", "used", "mean", "max", "samples"], rows)


def _instances(look: Look, view: View) -> Table:
    shown = [i for i in look.statistics["instances"] if view.lets(i["name"], i["verb"], i["owner"])]
    rows = [(i["name"], i["verb"], i["state"], i["list"], f"{i['running_s']:.1f} s", i["owner"] or "") for i in shown]
    looks = [{"running": "good", "suspended": "warn", "queued": "warn"}.get(i["state"], "soft") for i in shown]
    return Table("verb instances", ["instance", "verb", "state", "list", "running", "supports"], rows, looks)


def _devices(look: Look, view: View) -> Table:
    s = look.statistics
    rows = [(name, state, "logical") for name, state in s["devices"].items() if view.lets(name)]
    physical = [(name, p) for name, p in s["physical_devices"].items() if view.lets(name)]
    rows += [(name, f"lost: {p['lost']}" if p["lost"] else _counted("open", p), "physical") for name, p in physical]
    looks = ["bad" if state == "fault" or state.startswith("lost") else "good" if state == "moving" else "" for _, state, _ in rows]
    return Table("devices", ["device", "state", "kind"], rows, looks)


def _counted(state: str, physical: Mapping[str, Any]) -> str:
    """Returns the state of a physical device, with its driver's counters: `open, 3 frames_lost`."""
    return ", ".join([state, *(f"{count} {name}" for name, count in physical.get("counters", {}).items())])


def _alarms(look: Look, view: View) -> Table:
    shown = [a for a in look.alarms if view.lets(a["code"], a["source"], a["text"])]
    rows = [
        (a["number"], a["severity"], "active" if a["active"] else "returned", a["code"], a["source"], a["text"], a["count"]) for a in shown
    ]
    looks = ["bad" if a["active"] else "soft" for a in shown]
    return Table("alarms", ["number", "severity", "state", "code", "source", "text", "count"], rows, looks)


def _time(ns: float) -> str:
    return duration_text(ns, digits=3)
