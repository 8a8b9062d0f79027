# SPDX-License-Identifier: Apache-2.0
"""The text of a definition file as a tree, and what is wrong in it with its line."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path as File
from typing import Any

from ..errors import DefinitionError, Error, FileFailed
from ..places import Place
from .form import Finding
from .positions import Path, line_at


def is_toml(file: File) -> bool:
    """Whether it is TOML, by its ending."""
    if file.suffix not in (".toml", ".json"):
        raise FileFailed(
            f"the file '{file}' is neither TOML nor JSON", remedy="give it the ending .toml or .json", place=Place(str(file), 1)
        )
    return file.suffix == ".toml"


def parsed(file: File, text: str, toml: bool) -> Any:
    """The tree of a text; an error in it has its line."""
    try:
        return tomllib.loads(text) if toml else json.loads(text, object_pairs_hook=_once, parse_constant=_no_constant)
    except tomllib.TOMLDecodeError as error:
        found = re.search(r" \(at line (\d+), column \d+\)$", str(error))
        line, why = (int(found[1]), str(error)[: found.start()]) if found else (max(1, text.count("\n")), str(error))
    except json.JSONDecodeError as error:
        line, why = error.lineno, error.msg
    except ValueError as error:
        line, why = 1, str(error)
    what = "TOML" if toml else "JSON"
    raise DefinitionError(
        f"the file is no {what}: {why[:1].lower()}{why[1:]}", remedy="mend this line first", place=Place(str(file), line)
    ) from None


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    made: dict[str, Any] = {}
    for key, value in pairs:
        if key in made:
            raise ValueError(f"'{key}' is there twice in one object")
        made[key] = value
    return made


def _no_constant(text: str) -> Any:
    raise ValueError(f"{text} is no number")


def error_of(finding: Finding, file: File, lines: dict[Path, int]) -> Error:
    """The exception for a finding."""
    return finding.kind(finding.message, remedy=finding.remedy, place=Place(str(file), line_at(lines, finding.path)))
