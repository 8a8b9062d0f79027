# SPDX-License-Identifier: Apache-2.0
"""Plans a verb instead of starting it, in a program that `opengpac check` executes."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Self

from .. import _native, checking
from ..application.application import checked_application, checked_values
from ..application.reports import Report
from ..errors import Error, refusals
from ..values.arrays import np
from ..values.encoding import dtype_of, plain

if TYPE_CHECKING:
    from ..definition.verbs import Verb


class CheckedInstance:
    """Stand-in for a verb instance in a checked program: every start ends immediately with `completed`."""

    def __init__(self, report: Report, check: Callable[[Any, dict[str, Any]], None]) -> None:
        self.report = report
        self._check = check
        self.state, self.done, self.name = "ended", True, report.instance

    def start(self, *args: Any, **kwargs: Any) -> Self:
        """Checks the values without starting anything."""
        self._check(args, kwargs)
        return self

    def wait(self, timeout: Any = None) -> Report:
        """Returns a report with zeros."""
        return self.report

    def delete(self) -> None:
        """Does nothing: no instance exists."""

    suspend = resume = halt = delete

    def set(self, **_: Any) -> None:
        """Does nothing: no instance runs."""

    def __await__(self) -> Any:
        yield from ()
        return self.report

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        return None


def plan(verb: Verb[..., Any], args: Any, kwargs: dict[str, Any], signature: Any) -> CheckedInstance:
    """Plans one application of a verb and records the findings."""
    findings = checking.found()
    outputs: dict[str, Any] = {}
    made: tuple[Any, dict[str, Any], dict[str, Any]] | None = None

    def check_start(args: Any, kwargs: dict[str, Any]) -> None:
        if made is None:
            return
        system, applied, objects = made
        try:
            values = checked_values(verb, args, kwargs, objects)
            with refusals:
                system._native.check({**applied, "values": values})
        except Error as error:
            checking.note(error)

    try:
        system, applied, objects = checked_application(verb, args, kwargs, signature)
        with refusals:
            planned = system._native.check(applied)
        made = system, applied, objects
        findings.planned.append(verb.name)
        findings.remarks += [f"{verb.name}: {r['text']}" for r in planned.get("remarks", [])]
        for output in planned.get("outputs", []):
            with refusals:
                tree = json.loads(_native.type_json(output["type_text"], "{}"))
            outputs[output["name"]] = plain(np.zeros((), dtype=dtype_of(tree)))
    except Error as error:
        checking.note(error)
    given = {"condition": "completed", "time_s": 0.0, "verb": verb.name, "instance": f"{verb.name}#0", "normal": True, "outputs": outputs}
    return CheckedInstance(verb.report_class(given), check_start)
