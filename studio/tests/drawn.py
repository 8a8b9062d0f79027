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


def careful() -> gpac.Verb:
    """A move that asks for homing, is suspended at rest, and has a budget and an interval that may change."""
    return gpac.Verb(
        "careful",
        blocks={"generator": gpac.library.motion_generator},
        objects={"arm": gpac.each(gpac.robots.Joint)},
        instantiation_parameters={
            "arm.commanded": ["generator.start", "generator.setpoint"],
            "arm.commanded_velocity": "generator.start_velocity",
        },
        input_parameters={
            "goal": gpac.input("generator.goal", within=("arm.position_min", "arm.position_max"), counted_from="arm.commanded"),
            "speed": gpac.input("generator.speed", default="25 %", within=(0.001, "arm.max_speed")),
            "override": gpac.input("generator.override", default=1.0, within=(0.0, 1.0), tunable=True),
        },
        requires={"arm.homed": gpac.required(gpac.NotHomed, when="arm.needs_home", remedy="home it first")},
        suspend=gpac.holding("generator.holding", "generator.held"),
        command_lists={"start": [gpac.activate("generator", every=gpac.interval("20 ms", tunable=True), budget="5 ms")]},
        conditions={"there": gpac.on("generator.finished", returns=[])},
    )


def thinned() -> gpac.Graph:
    """A filter that runs once in five invocations of what it filters, and reads five values then."""
    return gpac.Graph(
        "thinned",
        blocks={"wave": gpac.library.signal_generator, "slow": gpac.library.lowpass},
        cells={"raw": ["wave.y", "slow.u"]},
        outputs={"y": "slow.y"},
        modes={"slow.u": gpac.ratio(5)},
        divide={"slow": 5},
    )


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
    for sets in (of["cells"], of.get("instantiation_parameters", {})):
        for ports in sets.values():
            ports.sort()
    return of


def compare(verb: gpac.Verb | gpac.Graph, folder: Path, kind: str, parts: list[str], **given: object) -> None:
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
            compare(careful(), folder, "verbs", [], system=cell)
            compare(thinned(), folder, "graphs", [], system=cell)
            compare(whole, folder, "compositions", ["approach", "insert"], system=cell, modules={"closed_loop": code}, devices=[Slide])
