# SPDX-License-Identifier: Apache-2.0
"""Definitions for the test of files: `files.py write FOLDER` saves 200 of them, `files.py compare FOLDER` compares what came back.

Half of them are the motion verbs and random graphs, nested up to three deep, as JSON, half the same as TOML.
"""

import json
import random
import sys
from pathlib import Path

import opengpac as gpac
from opengpac import activate, motion, on
from opengpac import library as lib

SEED = 16
DEFINITIONS = 200


class Collision(gpac.Terminated):
    """It has met something."""


def graph(name: str, rnd: random.Random, depth: int) -> gpac.Graph:
    nested = depth > 0 and rnd.random() < 0.7
    first = graph(f"{name}_in", rnd, depth - 1) if nested else lib.gain(k=rnd.uniform(-2.0, 2.0))
    return gpac.Graph(
        name,
        doc=rnd.choice(["", "Smooths.", "Two lines.\n\nThe second."]),
        blocks={"first": first, "second": lib.lowpass(alpha=rnd.random())},
        inputs={"u": "first.u"},
        outputs={"y": "second.y"},
        cells={"between": ["first.y", "second.u"]},
    )


def verb(name: str, rnd: random.Random) -> gpac.Verb:
    return gpac.Verb(
        name,
        doc="Waits, and ends.",
        blocks={
            "wave": lib.signal_generator(frequency=rnd.uniform(0.1, 5.0)),
            "inner": graph(f"{name}_graph", rnd, 2),
            "side": lib.comparator,
        },
        cells={"y": ["wave.y", "inner.u"], "z": ["inner.y", "side.u"]},
        input_parameters={"level": gpac.input("side.reference", default=rnd.uniform(-1.0, 1.0), tunable=rnd.random() < 0.5)},
        command_lists={
            "start": [activate("wave", every=f"{rnd.randint(1, 50)} ms"), activate("inner"), activate("side")],
            "stop": [activate("wave", every="20 ms"), activate("inner"), activate("side")],
        },
        initial="start",
        conditions={"rose": on("side.rose", during="start"), "lost": on("side.fell", raises=rnd.choice([None, Collision]))},
        transitions={("start", "rose"): "stop"},
        if_cut_off=rnd.choice(["halt", "continue", "safe"]),
    )


def definitions() -> list:
    rnd = random.Random(SEED)
    known = [getattr(motion, name) for name in dir(motion)]
    made = [one for one in known if isinstance(one, gpac.Verb)]
    while len(made) < DEFINITIONS // 2:
        name = f"made{len(made)}"
        made.append(verb(name, rnd) if rnd.random() < 0.5 else graph(name, rnd, 3))
    return made


def meant(path: Path, name: str) -> object:
    """What a file says of a definition, in one form."""
    again = path.with_name(f"{path.name}.again.json")
    again.unlink(missing_ok=True)
    gpac.load(path, raises={"Collision": Collision})[name].save(again)

    def plain(node: object) -> object:
        if isinstance(node, dict):
            return {key: plain(value) for key, value in node.items() if key != "layout"}
        return [plain(value) for value in node] if isinstance(node, list) else node

    return plain(json.loads(again.read_text()))


if __name__ == "__main__":
    what, folder = sys.argv[1], Path(sys.argv[2])
    for definition in definitions():
        for ending in ("json", "toml"):
            path = folder / f"{definition.name}.{ending}"
            if what == "write":
                definition.save(path)
            else:
                assert meant(folder / f"{path.name}.saved.json", definition.name) == meant(path, definition.name), path.name
    print(f"{what}: {DEFINITIONS} definitions")
