# SPDX-License-Identifier: Apache-2.0
"""The core has one rule for valid names: it applies to names given in Python and to those seen only by the core."""

import json

import pytest

import opengpac as gpac

NO_NAMES = {
    " ": r"is ' '; give a name, for example 'cell'",
    "a\nb": r"is 'a\\nb', which contains characters that cannot be printed; remove line breaks and control characters",
    "a\u200bb": r"is 'a\\u\{200b\}b', which contains characters that cannot be printed",
    "a\u202eb": r"is 'a\\u\{202e\}b', which contains characters that cannot be printed",
    "x" * 257: r"is 257 characters long; give a name of at most 256",
}


@pytest.mark.parametrize("name", NO_NAMES)
def test_what_is_no_name_is_refused_by_one_rule(cell: gpac.System, name: str) -> None:
    with pytest.raises(gpac.CallError, match="the name passed to System.* " + NO_NAMES[name]):
        gpac.System(name, clock="virtual")
    request = {"name": name, "type_text": "double"}
    with pytest.raises(gpac.CallError, match="the name of an SVV " + NO_NAMES[name]), gpac.errors.refusals:
        cell._alive().call("svv", json.dumps(request))


@pytest.mark.parametrize("name", ["cell", "x" * 256, "Zelle 4", "手臂", "ur5e.wrist_3"])
def test_what_is_a_name_is_taken(name: str) -> None:
    with gpac.System(name, clock="virtual") as cell:
        assert cell.name == name
