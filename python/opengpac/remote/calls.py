# SPDX-License-Identifier: Apache-2.0
"""A real-time system elsewhere: each call of the package as a request to its control interface. Conversions only."""

from __future__ import annotations

import base64
import json
import threading
from typing import Any

from .. import _native
from ..realtime import RealTimeSystem
from . import files
from .emptying import leave_empty
from .ends import Ends
from .session import Session

SLICE_MS = 100
"""How long one request of a wait lasts: an interrupt leaves the system waiting for nobody that much longer."""


class Remote(RealTimeSystem):
    """The calls of a real-time system that a session reaches. `_native.pyi` says what each means."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self._ends: Ends | None = None
        self._lock = threading.Lock()

    def _call(self, call: str, /, **arguments: Any) -> Any:
        """A call by its arguments; what is None is left out."""
        return self._answer(call, {name: value for name, value in arguments.items() if value is not None})["result"]

    def _whole(self, call: str, definition_json: str, /, **more: Any) -> Any:
        """A call whose arguments are one definition."""
        return self._answer(call, {**json.loads(definition_json), **more})["result"]

    def _text(self, call: str, /, **arguments: Any) -> str:
        return json.dumps(self._call(call, **arguments))

    def _answer(self, call: str, arguments: dict[str, Any]) -> dict[str, Any]:
        return self._sent(call, json.dumps(arguments))

    def _sent(self, call: str, arguments_json: str) -> dict[str, Any]:
        return self.session.answer("POST", f"/v1/call/{call}", arguments_json.encode())

    def _wait(self, call: str, /, **arguments: Any) -> Any:
        """A call that lasts, in slices, to its end."""
        arguments = {name: value for name, value in arguments.items() if value is not None}
        while True:
            answer = self._answer(call, {**arguments, "slice_ms": SLICE_MS})
            if not answer.get("waiting"):
                return answer["result"]
            call, arguments = answer["go_on"]["call"], answer["go_on"]["arguments"]

    # ---- configuration ----

    def processor(
        self,
        name: str,
        core: int | None,
        supervisor: bool,
        process: bool | str,
        host: str | None,
        lost_after_ns: int | None = None,
        patience_ns: int | None = None,
    ) -> None:
        try:
            self._call(
                "processor",
                name=name,
                core=core,
                supervisor=supervisor,
                process=process,
                host=host,
                lost_after_ns=lost_after_ns,
                patience_ns=patience_ns,
            )
        except _native.Refused:
            there = self._left("processors", name)
            if there is None or there["core"] != core or (supervisor and not there["supervisor"]):
                raise

    def listen(self, options_json: str) -> None:
        self._call("listen", **json.loads(options_json))

    def take_over(self) -> str:
        return self._text("take_over")

    def source(self, processor: str, name: str, kind: str, period_ns: int, priority: int, virtual_cost_ns: int) -> None:
        asked = {"period_ns": period_ns, "priority": priority, "virtual_cost_ns": virtual_cost_ns}
        try:
            self._call("source", processor=processor, name=name, kind=kind, **asked)
        except _native.Refused:
            same = {"processor": processor, "kind": {"timer": {"period_ns": period_ns}} if kind == "timer" else kind, "priority": priority}
            if self._left("sources", f"{processor}.{name}") != same:
                raise

    def _left(self, kind: str, name: str) -> dict[str, Any] | None:
        """What a program that took the system for its own has left there: it cannot be deleted, and the next one may make it again."""
        return self._call("configuration")[kind].get(name) if self.session.whole else None

    def request(self, source: str) -> None:
        self._call("request", source=source)

    def raise_source(self, device: str, channel: str, source: str, place_json: str) -> None:
        self._call("raises", device=device, channel=channel, source=source, place=json.loads(place_json))

    def physical_device(self, processor: str, name: str, kind: str, options_json: str, source: str, place_json: str) -> str:
        options = files.carried(self.session, kind, json.loads(options_json))
        place = json.loads(place_json)
        return self._text("physical_device", processor=processor, name=name, kind=kind, options=options, source=source, place=place)

    def reopen_physical_device(self, name: str) -> None:
        self._call("reopen_physical_device", name=name)

    def delete_physical_device(self, name: str) -> None:
        self._call("delete_physical_device", name=name)

    def download(self, path: str, name: str | None) -> str:
        return json.dumps(files.put_module(self.session, path, name))

    def place(self, placement_json: str) -> None:
        self._whole("place", placement_json)

    def define_verb(self, verb_json: str) -> None:
        self._whole("define_verb", verb_json)

    def check_graph(self, graph_json: str) -> None:
        self._whole("check_graph", graph_json)

    def check_definition(self, drawing_json: str) -> str:
        return json.dumps(self._whole("check_definition", drawing_json))

    def compatible(self, drawing_json: str, source_json: str, sink_json: str) -> str:
        ends = {"from": json.loads(source_json), "to": json.loads(sink_json)}
        return json.dumps(self._whole("compatible", drawing_json, **{name: end for name, end in ends.items() if end is not None}))

    def compose(self, composition_json: str) -> str:
        return json.dumps(self._whole("compose", composition_json))

    def define_device_type(self, type_json: str) -> None:
        self._whole("define_device_type", type_json)

    def svv(self, name: str, specification_json: str, place_json: str) -> None:
        self._whole("svv", specification_json, name=name, place=json.loads(place_json))

    def delete_svv(self, name: str) -> None:
        self._call("delete_svv", name=name)

    def device(self, name: str, device_json: str) -> None:
        self._whole("device", device_json, name=name)

    def enable(self, device: str) -> int:
        return self._call("enable", name=device)

    def disable(self, device: str) -> None:
        self._wait("disable", name=device)

    def exchange_verb(self, device: str, verb: str, place_json: str) -> None:
        self._call("exchange_verb", device=device, verb=verb, place=json.loads(place_json))

    def delete_device(self, device: str) -> None:
        self._call("delete_device", name=device)

    def device_state(self, device: str) -> str:
        return self._call("device_state", name=device)

    def wait_enabled(self, device: str, timeout_ns: int | None) -> bool:
        return self._wait("wait_enabled", name=device, timeout_ns=timeout_ns)

    def set_device_parameter(self, device: str, parameter: str, value_json: str) -> None:
        self._call("set_device_parameter", name=device, parameter=parameter, value=json.loads(value_json))

    def device_parameter(self, device: str, parameter: str) -> str:
        return self._text("device_parameter", name=device, parameter=parameter)

    # ---- verb instances ----

    def check(self, application_json: str) -> str:
        return json.dumps(self._whole("check", application_json))

    def create(self, application_json: str) -> int:
        return self._whole("create", application_json)

    def instance_json(self, instance: int) -> str:
        return self._text("instance", instance=instance)

    def start(self, instance: int, values_json: str, options_json: str) -> None:
        # Of texts that are JSON already: a start is what is waited for.
        self._sent("start", f'{{"instance": {instance}, "values": {values_json}, "limits": {options_json}}}')

    def suspend(self, instance: int) -> None:
        self._call("suspend", instance=instance)

    def resume(self, instance: int) -> None:
        self._call("resume", instance=instance)

    def halt(self, instance: int) -> None:
        self._wait("halt", instance=instance)

    def wait(self, instance: int, timeout_ns: int | None, slice_ns: int) -> str | None:
        if slice_ns == 0:
            report = self._wait("wait", instance=instance, timeout_ns=timeout_ns)
        else:
            slice_ms = max(1, min(SLICE_MS, slice_ns // 1_000_000))
            limit = {} if timeout_ns is None else {"timeout_ns": timeout_ns}
            answer = self._answer("wait", {"instance": instance, "slice_ms": slice_ms, **limit})
            report = None if answer.get("waiting") else answer["result"]
        return None if report is None else json.dumps(report)

    def report(self, instance: int) -> str | None:
        report = self._call("report", instance=instance)
        return None if report is None else json.dumps(report)

    def state(self, instance: int) -> str:
        return self._call("state", instance=instance)

    def delete(self, instance: int) -> None:
        self._call("delete", instance=instance)

    def set(self, instance: int, values_json: str, every_json: str) -> None:
        self._call("set", instance=instance, values=json.loads(values_json), every_ns=json.loads(every_json))

    def ended_fd(self) -> int:
        with self._lock:
            if self._ends is None:
                self._ends = Ends(self.session)
                self.session.at_end(self._ends.close)
            return self._ends.fd

    # ---- SVVs ----

    def read(self, names: list[str]) -> tuple[int, list[tuple[bytes, int, int]]]:
        told = self._call("read", names=names, raw=True)
        rows = [told["values"][name] for name in names]
        return told["time_ns"], [(base64.b64decode(row["bytes"]), row["number"], row["time_ns"]) for row in rows]

    def write(self, name: str, value_json: str) -> None:
        self._call("write", name=name, value=json.loads(value_json))

    def history(self, name: str, count: int) -> list[tuple[int, int, bytes]]:
        rows = self._call("history", name=name, count=count, raw=True)
        return [(row["number"], row["time_ns"], base64.b64decode(row["bytes"])) for row in rows]

    def svv_json(self, name: str) -> str:
        return self._text("svv_about", name=name)

    # ---- time and the whole system ----

    def now(self) -> int:
        return self._call("now")

    def advance(self, duration_ns: int) -> None:
        self._wait("advance", duration_ns=duration_ns)

    def step(self) -> bool:
        return self._call("step")

    def emergency_stop(self, reason: str) -> None:
        self._call("emergency_stop", reason=reason)

    def emergency_stop_input(self, device: str, channel: str, at_zero: bool) -> None:
        self._call("emergency_stop_input", device=device, channel=channel, at_zero=at_zero)

    def reset(self) -> None:
        self._call("reset")

    def pause(self, devices: list[str] | None) -> list[str]:
        return self._wait("pause", devices=devices)

    def resume_program(self, devices: list[str] | None) -> list[str]:
        return self._call("resume_program", devices=devices)

    def mode(self) -> str:
        return self._call("mode")

    def set_mode(self, mode_json: str) -> None:
        self._call("set_mode", mode=json.loads(mode_json))

    def enabling_switch(self, device: str, channel: str) -> None:
        self._call("enabling_switch", device=device, channel=channel)

    def define_alarm(self, code: str, text_json: str) -> None:
        self._whole("define_alarm", text_json, code=code)

    def raise_alarm(self, code: str, source: str, text: str) -> None:
        self._call("raise_alarm", code=code, source=source, text=text)

    def clear_alarm(self, code: str, source: str | None) -> bool:
        return self._call("clear_alarm", code=code, source=source)

    def acknowledge_alarms(self, number: int | None) -> int:
        return self._call("acknowledge_alarms", number=number)

    def alarms_json(self) -> str:
        return self._text("alarms")

    def restore_alarms(self, history_json: str) -> None:
        self._call("restore_alarms", history=json.loads(history_json))

    def statistics_json(self) -> str:
        return self._text("statistics")

    def probe(self, source: str | None, for_ns: int) -> None:
        self._call("probe", source=source, for_ns=for_ns)

    def verbs_json(self) -> str:
        return self._text("verbs")

    def names_json(self) -> str:
        return self._text("names")

    def configuration_json(self) -> str:
        return self._text("configuration")

    def installed_json(self) -> str:
        return self._text("installed")

    def verb_form_json(self, name: str) -> str:
        return self._text("verb_form", name=name)

    def geometry_json(self, device: str) -> str:
        return self._text("geometry", device=device)

    def log_json(self, since: int) -> str:
        return self._text("log", since=since)

    def record(self, path: str, options_json: str) -> int:
        return self._whole("record", options_json, path=path)["recording"]

    def recording_json(self, number: int) -> str:
        return self._text("recording", recording=number)

    def stop_recording(self, number: int) -> str:
        while True:
            summary = self._call("stop_recording", recording=number)
            if not summary["running"]:
                return json.dumps(summary)

    def close(self) -> None:
        if self.session.whole and not self.session.lost:
            leave_empty(self)
        self.session.close()
