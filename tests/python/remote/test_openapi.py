# SPDX-License-Identifier: Apache-2.0
"""The OpenAPI document and the schemas of the control interface, checked by third-party implementations."""

from __future__ import annotations

import http.client
import json
import socket
from pathlib import Path
from typing import Any

import jsonschema
import openapi_spec_validator as openapi

import opengpac as gpac
from daemons import Daemon

SCHEMAS = Path(__file__).parents[3] / "crates" / "control" / "schemas"
DOCUMENT = json.loads((SCHEMAS / "openapi-v1.json").read_text())
REFUSED = DOCUMENT["components"]["responses"]["Refused"]["content"]["application/json"]["schema"]
# Read-only calls without arguments.
PLAIN = ("names", "installed", "statistics", "configuration", "verbs", "library", "alarms", "log", "now", "mode")


def asked(daemon: Daemon, method: str, path: str, body: object = None) -> Any:
    """Returns the daemon's answer as JSON."""
    connection = http.client.HTTPConnection("localhost")
    connection.sock = socket.socket(socket.AF_UNIX)
    connection.sock.connect(str(daemon.socket))
    try:
        connection.request(method, path, None if body is None else json.dumps(body))
        return json.loads(connection.getresponse().read())
    finally:
        connection.close()


def check(answer: Any, schema: dict[str, Any]) -> None:
    """Checks that an answer conforms to a schema of the document."""
    validator = jsonschema.Draft202012Validator({**schema, "components": DOCUMENT["components"]})
    wrong = [f"{'/'.join(map(str, error.absolute_path))}: {error.message[:300]}" for error in validator.iter_errors(answer)]
    assert not wrong, wrong[:5]


def operations() -> list[tuple[str, str, dict[str, Any]]]:
    return [(path, method, of) for path, methods in DOCUMENT["paths"].items() for method, of in methods.items()]


def answer_schema(path: str, method: str = "post") -> dict[str, Any]:
    return DOCUMENT["paths"][path][method]["responses"]["200"]["content"]["application/json"]["schema"]


def test_the_document_is_openapi() -> None:
    openapi.validate(DOCUMENT, cls=openapi.OpenAPIV31SpecValidator)


def test_every_schema_is_one() -> None:
    jsonschema.Draft202012Validator.check_schema({"$defs": DOCUMENT["components"]["schemas"]})
    schemas = json.loads((SCHEMAS / "control-v1.json").read_text())
    jsonschema.Draft202012Validator.check_schema({"$defs": schemas["$defs"]})
    for call in schemas["calls"].values():
        jsonschema.Draft202012Validator.check_schema(call["arguments"])
        jsonschema.Draft202012Validator.check_schema(call["result"])


def test_no_answer_is_any() -> None:
    """Every answer of a call has a type; only a value of the user's own type is a `Value`."""
    schemas = json.loads((SCHEMAS / "control-v1.json").read_text())
    assert not [name for name, call in schemas["calls"].items() if call["result"] in (True, {})]


def test_a_daemon_serves_the_document(daemon: Daemon) -> None:
    assert asked(daemon, "GET", "/v1/openapi.json") == DOCUMENT
    for path, method, of in operations():
        if method == "get" and "{" not in path and path not in ("/v1/stream", "/v1/hold"):
            check(asked(daemon, method.upper(), path), of["responses"]["200"]["content"]["application/json"]["schema"])


def test_what_looks_at_a_cell_that_moves_is_answered_as_the_document_says(daemon: Daemon, tmp_path: Path) -> None:
    with gpac.connect(daemon.url, name="tests") as cell:
        rtp = cell.processor("rtp0")
        fast, slow = rtp.timer("fast", period="1 ms", priority=80), rtp.timer("slow", period="20 ms", priority=60)
        arm = gpac.robots.load("ur5e", rtp, on=fast)
        cell.svv("tried", "double", history=10, within=(-1, 1))
        with arm.enabled():
            running = gpac.robots.move.on({"*": slow}).asynch(arm, goal=[joint.sensed.value + 0.1 for joint in arm])
            cell.advance("40 ms")
            names = asked(daemon, "POST", "/v1/call/names")["result"]
            installed = asked(daemon, "POST", "/v1/call/installed")["result"]
            number = next(one["id"] for one in installed["instances"] if one["name"] == running.name)
            cells = [one["name"] for instance in installed["instances"] for one in instance["cells"]]
            verb = next(one["verb"] for one in installed["instances"] if one["id"] == number)
            configuration = asked(daemon, "POST", "/v1/call/configuration")["result"]
            joint, of = next(iter(configuration["logical_devices"].items()))
            looks: list[tuple[str, dict[str, Any]]] = [
                *((name, {}) for name in PLAIN),
                *(("svv_about", {"name": name}) for name in {*names["svvs"], *cells}),
                *((word, {"instance": number}) for word in ("instance", "state", "report")),
                *(("device_state", {"name": name}) for name in names["logical_devices"]),
                *(("geometry", {"device": name}) for name in names["devices"]),
                *(("verb_form", {"name": name}) for name in names["verbs"]),
                ("read", {"names": names["svvs"]}),
                ("read", {"names": names["svvs"], "raw": True}),
                ("history", {"name": "tried", "count": 5}),
                ("device_parameter", {"name": joint, "parameter": next(iter(configuration["device_types"][of]["parameters"]))}),
            ]
            for call, arguments in looks:
                check(asked(daemon, "POST", f"/v1/call/{call}", arguments), answer_schema(f"/v1/call/{call}"))
            assert verb in names["verbs"]
            running.halt()
        ended = asked(daemon, "POST", "/v1/call/report", {"instance": number})
        check(ended, answer_schema("/v1/call/report"))
        check(asked(daemon, "POST", "/v1/call/svv_about", {"name": "nobody"}), REFUSED)
