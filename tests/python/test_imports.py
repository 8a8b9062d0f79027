# SPDX-License-Identifier: Apache-2.0
"""The modules of the package depend on each other in one direction. An import within a function counts, since it would only hide a
cycle.

Imports under `TYPE_CHECKING` are names for people and for pyright, and do not count.
"""

from __future__ import annotations

import ast
import math
import subprocess
import sys
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import opengpac
from opengpac import public

ROOT = Path(opengpac.__file__).parent
MODULES = {
    ".".join(("opengpac", *file.relative_to(ROOT).with_suffix("").parts)).removesuffix(".__init__"): file for file in ROOT.rglob("*.py")
}


def imports(node: ast.AST) -> Iterator[ast.Import | ast.ImportFrom]:
    """Yields every import below a node that is executed."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test):
            yield from (found for branch in child.orelse for found in imports(branch))
        elif isinstance(child, ast.Import | ast.ImportFrom):
            yield child
        else:
            yield from imports(child)


def used(module: str, source: str) -> set[str]:
    """Returns the modules of the package that a module imports."""
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
        # `from . import _native` refers to the compiled core, not to the package itself.
        compiled = isinstance(statement, ast.ImportFrom) and any(alias.name == "_native" for alias in statement.names)
        found |= {name for name in names if name in MODULES and name != module and not (compiled and name == "opengpac")}
    return found


def test_no_module_imports_itself_by_way_of_others() -> None:
    above = {module: used(module, file.read_text()) for module, file in MODULES.items()}
    assert len(above) > 100 and above["opengpac.definition.verbs"] >= {"opengpac.definition.blocks", "opengpac.application.instances"}
    try:
        TopologicalSorter(above).prepare()
    except CycleError as error:
        raise AssertionError(" -> ".join(error.args[1])) from None


def test_an_import_within_a_function_is_seen_and_one_for_types_is_not() -> None:
    source = (
        "if TYPE_CHECKING:\n    from ..system.system import System\n"
        "def f():\n    from .. import _native\n    from . import verbs\n    from ..top import board\n"
    )
    assert used("opengpac.definition.blocks", source) == {"opengpac.definition.verbs", "opengpac.top.board"}


def printed(program: str, *words: str) -> str:
    """Returns the output of a program in a Python process of its own."""
    return subprocess.run([sys.executable, "-c", program, *words], capture_output=True, text=True, check=True).stdout.strip()


PROCESS = "opengpac.driver.process"
"""Word that identifies the process of a driver in Python."""


def test_a_program_loads_what_it_uses_and_no_more() -> None:
    """Unused modules in each of a thousand short programs cost half a second."""
    loaded = printed("import sys, opengpac; print(*sys.modules)").split()
    assert not {"opengpac.system.system", "opengpac.definition.blocks", "numpy"} & {*loaded}
    loaded = printed("import sys, opengpac as gpac; gpac.System('cell', clock='virtual').close(); print(*sys.modules)").split()
    unused = {"asyncio", "http.client", "tomlkit", "importlib.metadata", "opengpac.fmi", "opengpac.python", "opengpac.recordings"}
    assert not unused & {*loaded}


NUMBERS = """
import sys
import opengpac as gpac
from opengpac import activate, library
with gpac.System("cell", clock="virtual") as cell:
    fast = cell.processor("rtp0").timer("fast", period="1 ms")
    drive = fast.processor.physical_device("drive", gpac.drivers.loopback("x"), exchange=fast)
    verb = gpac.Verb("v", blocks={"g": library.signal_generator}, instantiation_parameters={"y": "g.y"},
                     command_lists={"start": [activate("g", every="1 ms")]})
    y = cell.svv("y")
    running = verb.on(fast).asynch(y)
    cell.advance(until=y >= 0.0)
    cell.advance("10 ms")
    running.halt()
    y.value = 3.0
    print(y.value, cell.read(y, drive["x"].position), "numpy" in sys.modules)
    print(y.dtype, "numpy" in sys.modules)
"""


def test_a_program_of_plain_numbers_needs_no_numpy() -> None:
    assert printed(NUMBERS).splitlines() == ["3.0 (3.0, 0.0) False", "float64 True"]


def test_a_verb_can_be_chained_before_anything_of_composition_was_used() -> None:
    program = """
from opengpac import Verb, activate, library
hold = Verb("hold", blocks={"k": library.gain(u=1.0)}, command_lists={"start": [activate("k")]})
print(*(hold >> hold).parts)
"""
    assert printed(program) == "hold hold_2"


def test_the_table_of_public_names_is_what_editors_read() -> None:
    tree = ast.parse(MODULES["opengpac.public"].read_text())
    (guarded,) = [node for node in tree.body if isinstance(node, ast.If)]
    read = {alias.name: node.module for node in guarded.body if isinstance(node, ast.ImportFrom) for alias in node.names}
    assert {name: module for name, module in read.items() if module} == public.homes()
    assert sorted(read) == sorted(public.__all__)


def test_the_process_of_a_driver_loads_neither_the_public_names_nor_numpy() -> None:
    loaded = printed("import sys, opengpac.driver.process; print(*sys.modules)", PROCESS).split()
    assert {"opengpac.driver", "opengpac._native"} <= {*loaded}
    assert not {"opengpac.public", "opengpac.system.system", "numpy", "asyncio", "tomlkit"} & {*loaded}


@pytest.mark.parametrize("words", [(), (PROCESS,)], ids=["a program", "a driver"])
def test_every_public_name_is_there(words: tuple[str, ...]) -> None:
    program = "import opengpac.driver, opengpac as gpac; print(*(name for name in gpac.__all__ if getattr(gpac, name) is not None))"
    assert printed(program, *words).split() == public.__all__
    assert printed("from opengpac import *; print(System.__name__, deg(180), cell.__name__)", *words) == f"System {math.pi} opengpac.cell"
    assert printed("from opengpac.robots import load; import opengpac; print(opengpac.Verb.then.__name__)", *words) == "then"
    assert printed("import opengpac; print(opengpac.recordings.__name__)", *words) == "opengpac.recordings"
    refused = printed("import opengpac\ntry:\n    opengpac.sistem\nexcept AttributeError as error:\n    print(error)", *words)
    assert refused == "module 'opengpac' has no attribute 'sistem'"


def test_threads_of_a_driver_that_use_the_first_names_at_once_find_them() -> None:
    program = """
import threading, opengpac
together, found = threading.Barrier(8), []
def use(name):
    together.wait()
    found.append(getattr(opengpac, name).__name__)
names = ["System", "Verb", "Graph", "wait", "save", "deg", "library", "Pose"]
threads = [threading.Thread(target=use, args=(name,)) for name in names]
for thread in threads: thread.start()
for thread in threads: thread.join()
print(*sorted(found))
"""
    assert printed(program, PROCESS) == "Graph Pose System Verb deg opengpac.library save wait"
