# SPDX-License-Identifier: Apache-2.0
"""The modules of each Rust crate depend on each other in one direction, as the package's do (`tests/python/test_imports.py`).

A module depends on its submodules, whose items it re-exports; their use of it is not a cycle. A cycle through a parent is therefore
found: a user of the parent may use an item that one of its children defines.
"""

from __future__ import annotations

import re
from collections.abc import Container, Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CRATES = sorted(folder for folder in (ROOT / "crates").iterdir() if (folder / "src").is_dir())

Module = tuple[str, ...]

USE = re.compile(r"\buse\s+((?:crate|self|super)::[^;]+);")
PATH = re.compile(r"\b(?:crate|super)(?:::\w+)+")
COMMENT = re.compile(r"//[^\n]*")


def modules(source: Path) -> dict[Module, Path]:
    """Returns the modules of a crate by their paths."""
    found: dict[Module, Path] = {}
    for file in source.rglob("*.rs"):
        parts = file.relative_to(source).with_suffix("").parts
        found[() if parts in {("lib",), ("main",)} else parts[:-1] if parts[-1] == "mod" else parts] = file
    return found


def flat(tree: str) -> Iterator[str]:
    """Yields the paths of a `use`: `a::{b, c::d}` is `a::b` and `a::c::d`."""
    head, brace, rest = tree.partition("{")
    if not brace:
        yield tree.split(" as ")[0].strip()
        return
    depth, part = 0, ""
    for letter in rest.rstrip().removesuffix("}") + ",":
        if letter == "," and depth == 0:
            yield from flat(head + part.strip()) if part.strip() else ()
            part = ""
            continue
        depth += (letter == "{") - (letter == "}")
        part += letter


def target(path: str, module: Module, known: Container[Module]) -> Module:
    """Returns the module to which a path in another module leads."""
    first, *steps = path.split("::")
    at = list(module) if first in {"self", "super"} else []
    if first == "super":
        at = at[:-1]
        while steps and steps[0] == "super":
            at, steps = at[:-1], steps[1:]
    for step in steps:
        if (*at, step.strip()) not in known:
            break
        at.append(step.strip())
    return tuple(at)


def used(text: str, module: Module, known: Container[Module]) -> set[Module]:
    """Returns the modules that a source uses, except for its own tests and its parent modules."""
    text = COMMENT.sub("", text.split("#[cfg(test)]\nmod ")[0])
    paths = [path for tree in USE.findall(text) for path in flat(" ".join(tree.split()))] + PATH.findall(text)
    found = {target(path, module, known) for path in paths}
    return {other for other in found if other != module[: len(other)]}


def edges(known: dict[Module, str]) -> dict[Module, set[Module]]:
    """Returns the modules on which each module depends, from the sources of all."""
    within = {module: {other for other in known if other[:-1] == module and other != ()} for module in known}
    return {module: used(text, module, known) | (within[module] if module else set()) for module, text in known.items()}


@pytest.mark.parametrize("crate", CRATES, ids=lambda crate: crate.name)
def test_no_module_of_a_crate_uses_itself_by_way_of_others(crate: Path) -> None:
    known = {module: file.read_text() for module, file in modules(crate / "src").items()}
    try:
        TopologicalSorter(edges(known)).prepare()
    except CycleError as error:
        raise AssertionError(f"{crate.name}: " + " -> ".join("::".join(module) for module in error.args[1])) from None


def test_uses_are_found_by_each_form() -> None:
    known = dict.fromkeys([("a",), ("a", "b"), ("a", "c"), ("d",), ("e",), ("f",)], "")
    text = "use crate::d::{X, y::Z};\nuse super::c;\npub(crate) use crate::{e::{P,\n Q}, f};\n// crate::a::b\n"
    assert used(text, ("a", "b"), known) == {("d",), ("a", "c"), ("e",), ("f",)}
    assert used("fn f() { crate::d::g() }\n#[cfg(test)]\nmod tests {\n use crate::e;\n}\n", ("a", "b"), known) == {("d",)}
    assert used("use crate::a::b;\nuse self::c::D;", ("a",), known) == {("a", "b"), ("a", "c")}


def test_a_circle_by_way_of_a_parent_is_found() -> None:
    known = {
        ("lead",): "use crate::reference::Inputs;",
        ("reference",): "pub use approach::Inputs;",
        ("reference", "approach"): "use crate::lead::Lead;",
    }
    with pytest.raises(CycleError):
        TopologicalSorter(edges(known)).prepare()
    known["lead",] = ""
    TopologicalSorter(edges(known)).prepare()
