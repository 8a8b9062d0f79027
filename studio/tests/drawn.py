# SPDX-License-Identifier: Apache-2.0
"""Compares verbs that were drawn with those of the docs: `drawn.py FOLDER` reads `NAME.json` there, and says which are equal.

Equal is what means the same: the order of the ports of a cell, and where boxes stand, say nothing.
"""

import ast
import json
import sys
from pathlib import Path

import opengpac as gpac

EXAMPLES = Path(__file__).parents[2] / "examples"
sys.path.insert(0, str(EXAMPLES))


def swing() -> gpac.Verb:
    """The first verb of the README: its definition alone, without the arm that it moves."""
    tree = ast.parse((EXAMPLES / "first_verb.py").read_text())
    wanted = [node for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom) or "swing = " in ast.unparse(node)[:8]]
    names: dict[str, gpac.Verb] = {}
    exec(compile(ast.Module(wanted, []), "first_verb.py", "exec"), names)
    return names["swing"]


def guarded_move(modules: dict[str, gpac.Module]) -> gpac.Verb:
    from guarded_move import Blocks, guarded_move

    return guarded_move(Blocks(modules["glide"], modules["tool_line"]))


def meant(path: Path, name: str) -> object:
    of = json.loads(path.read_text())["verbs"][name]
    of.pop("layout", None)
    for sets in (of["cells"], of["instantiation_parameters"]):
        for ports in sets.values():
            ports.sort()
    return of


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    with gpac.System("docs", clock="virtual") as cell:
        modules = {name: cell.download(EXAMPLES / "blocks" / f"{name}.c") for name in ("glide", "tool_line")}
        for verb in (swing(), guarded_move(modules)):
            (again := folder / f"{verb.name}.again.json").unlink(missing_ok=True)
            gpac.load(folder / f"{verb.name}.json", system=cell, modules=modules)[verb.name].save(again)
            verb.save(folder / f"{verb.name}.docs.json")
            drawn, wanted = meant(again, verb.name), meant(folder / f"{verb.name}.docs.json", verb.name)
            assert drawn == wanted, f"{json.dumps(drawn, indent=1, sort_keys=True)}\n{json.dumps(wanted, indent=1, sort_keys=True)}"
            print(f"{verb.name} is equal")
