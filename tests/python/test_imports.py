# SPDX-License-Identifier: Apache-2.0
"""The modules of the package stand on each other in one direction. An import within a function counts: it would only hide a circle.

What `TYPE_CHECKING` guards is names for people and for pyright, and does not count.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import opengpac

ROOT = Path(opengpac.__file__).parent
MODULES = {
    ".".join(("opengpac", *file.relative_to(ROOT).with_suffix("").parts)).removesuffix(".__init__"): file for file in ROOT.rglob("*.py")
}


def imports(node: ast.AST) -> Iterator[ast.Import | ast.ImportFrom]:
    """Every import below a node that runs."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test):
            yield from (found for branch in child.orelse for found in imports(branch))
        elif isinstance(child, ast.Import | ast.ImportFrom):
            yield child
        else:
            yield from imports(child)


def used(module: str, source: str) -> set[str]:
    """The modules of the package that a module imports."""
    parents = module.split(".")
    if MODULES.get(module, ROOT / "x.py").name != "__init__.py":
        parents.pop()
    found: set[str] = set()
    for statement in imports(ast.parse(source)):
        level = statement.level if isinstance(statement, ast.ImportFrom) else 0
        base = ".".join(parents[: len(parents) - level + 1]) if level else ""
        if isinstance(statement, ast.ImportFrom):
            base = ".".join(filter(None, (base, statement.module)))
            names = [f"{base}.{alias.name}" if f"{base}.{alias.name}" in MODULES else base for alias in statement.names]
        else:
            names = [alias.name for alias in statement.names]
        # `from . import _native` names the compiled core, not the package's own face.
        compiled = isinstance(statement, ast.ImportFrom) and any(alias.name == "_native" for alias in statement.names)
        found |= {name for name in names if name in MODULES and name != module and not (compiled and name == "opengpac")}
    return found


def test_no_module_imports_itself_by_way_of_others() -> None:
    above = {module: used(module, file.read_text()) for module, file in MODULES.items()}
    assert len(above) > 100 and above["opengpac.verbs"] >= {"opengpac.blocks", "opengpac.instances"}
    try:
        TopologicalSorter(above).prepare()
    except CycleError as error:
        raise AssertionError(" -> ".join(error.args[1])) from None


def test_an_import_within_a_function_is_seen_and_one_for_types_is_not() -> None:
    source = "if TYPE_CHECKING:\n    from .system import System\ndef f():\n    from . import _native, verbs\n    from .top import board\n"
    assert used("opengpac.blocks", source) == {"opengpac.verbs", "opengpac.top.board"}
