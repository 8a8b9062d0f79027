# SPDX-License-Identifier: Apache-2.0
"""Compares verbs that were drawn with those of the docs: `drawn.py FOLDER` reads `NAME.json` there, and says which are equal.
With `approach` behind it, it writes the verb of that name there, which is one of those that the press is made of.

Equal is what means the same: the order of the ports of a cell, and where boxes stand, say nothing.
"""

import ast
import json
import sys
from pathlib import Path

import opengpac as gpac

EXAMPLES = Path(__file__).parents[2] / "examples"
sys.path[:0] = [str(EXAMPLES), str(EXAMPLES / "levels")]


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


def slide_of(code: gpac.Module) -> type[gpac.LogicalDevice]:
    import actions

    class Slide(gpac.LogicalDevice, verb=actions.slide(code)):
        speed: gpac.SVV[float] = gpac.svv(unit="m/s")
        position: gpac.SVV[float] = gpac.svv(unit="m")

    return Slide


def press(code: gpac.Module, device: type[gpac.LogicalDevice]) -> gpac.Verb:
    import actions
    import sequence

    return sequence.press(actions.advance(code, device, "approach", 0.5), actions.advance(code, device, "insert", 0.02))


def meant(path: Path, name: str, kind: str = "verbs") -> object:
    of = json.loads(path.read_text())[kind][name]
    if kind == "compositions":
        of.pop("layout", None)
        return of
    of.pop("layout", None)
    for sets in (of["cells"], of["instantiation_parameters"]):
        for ports in sets.values():
            ports.sort()
    return of


def compare(verb: gpac.Verb, folder: Path, kind: str, parts: list[str], **given: object) -> None:
    (again := folder / f"{verb.name}.again.json").unlink(missing_ok=True)
    gpac.load(folder / f"{verb.name}.json", **given)[verb.name].save(again)
    verb.save(folder / f"{verb.name}.docs.json")
    for name, of in [(verb.name, kind), *((part, "verbs") for part in parts)]:
        drawn, wanted = meant(again, name, of), meant(folder / f"{verb.name}.docs.json", name, of)
        assert drawn == wanted, f"{name}: {json.dumps(drawn, indent=1, sort_keys=True)}\n{json.dumps(wanted, indent=1, sort_keys=True)}"
    print(f"{verb.name} is equal")


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    with gpac.System("docs", clock="virtual") as cell:
        code = cell.download(EXAMPLES / "levels" / "closed_loop.c")
        Slide = slide_of(code)
        whole = press(code, Slide)
        if "approach" in sys.argv[2:]:
            whole.parts["approach"].save(folder / "approach.json")
        else:
            modules = {name: cell.download(EXAMPLES / "blocks" / f"{name}.c") for name in ("glide", "tool_line")}
            compare(swing(), folder, "verbs", [], system=cell, modules=modules)
            compare(guarded_move(modules), folder, "verbs", [], system=cell, modules=modules)
            compare(whole, folder, "compositions", ["approach", "insert"], system=cell, modules={"closed_loop": code}, devices=[Slide])
