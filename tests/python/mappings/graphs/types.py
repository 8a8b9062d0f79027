# SPDX-License-Identifier: Apache-2.0
"""Types: structs, structs of structs, integers and floats of every width, truth values."""

from __future__ import annotations

import numpy as np

from mappings.graph import LENGTH, Graph, Model, Stage, graph
from opengpac import activate
from opengpac import library as lib


def _places() -> Model:
    return {"y": [[k + 2.0, -0.5 * k, float(2 * np.float32(0.25) * np.float32(k % 16)), float(k)] for k in range(LENGTH)]}


@graph(_places)
def struct_over_three_processors(stage: Stage) -> Graph:
    """A position, advanced by the next processor and decomposed by the one after it."""
    code = stage.code
    return Graph(
        blocks={"places": code.places, "step": code.step_on(size=2.0), "unfold": code.unfold_place},
        cells={"at": ["places.at", "step.at"], "next": ["step.next", "unfold.at"]},
        place={"places": "0.fast", "step": "1.soft", "unfold": "2.soft"},
        record={"y": "unfold.y"},
        recorder={"y": "record_vector"},
        start=[activate("unfold"), activate("step"), activate("places", every="2 ms")],
    )


@graph()
def struct_of_structs(stage: Stage) -> Graph:
    """Two positions created separately form one leg on a third processor, and become numbers on the first."""
    code = stage.code
    return Graph(
        blocks={
            "places": code.places,
            "near": code.step_on(size=1.0),
            "far": code.step_on(size=9.0),
            "join": code.join_legs,
            "unfold": code.unfold_leg,
        },
        cells={
            "at": ["places.at", "near.at", "far.at"],
            "from": ["near.next", "join.from"],
            "to": ["far.next", "join.to"],
            "way": ["join.way", "unfold.way"],
        },
        place={"places": "0.fast", "near": "1.soft", "far": "2.soft", "join": "2.low", "unfold": "0.soft"},
        record={"y": "unfold.y"},
        recorder={"y": "record_vector"},
        start=[*(activate(label) for label in ("unfold", "join", "far", "near")), activate("places", every="2 ms")],
    )


def _widths() -> Model:
    def at(k: int) -> float:
        i8 = (k * 3 + 128) % 256 - 128
        return i8 + 2.0 * (k * 257 % 65536) + 3.0 * (-k * k * k) + 4.0 * float(np.float32(k) / np.float32(3))

    return {"y": [at(k) for k in range(LENGTH)]}


@graph(_widths)
def every_width_of_numbers(stage: Stage) -> Graph:
    """Integers of 8, 16 and 64 bits and a float keep their bits in transit."""
    names = ("i8", "u16", "i64", "f")
    return Graph(
        blocks={"widths": stage.code.widths, "gather": stage.code.gather_widths},
        cells={name: [f"widths.{name}", f"gather.{name}"] for name in names},
        place={"widths": "0.fast", "gather": "1.soft"},
        record={"y": "gather.y"},
        start=[activate("gather"), activate("widths", every="2 ms")],
    )


def _digests() -> Model:
    found, digest = [], 0
    for k in range(LENGTH):
        digest = (digest * 6364136223846793005 - k * k * k) % 2**64
        found.append(digest)
    return {"y": found}


@graph(_digests)
def digest_of_integers(stage: Stage) -> Graph:
    """A digest shows permanently if a single value was lost, duplicated or changed."""
    return Graph(
        blocks={"widths": stage.code.widths, "digest": stage.code.digest},
        cells={"u": ["widths.i64", "digest.u"]},
        place={"widths": "0.fast", "digest": "1.soft", "record_y": "2.soft"},
        record={"y": "digest.y"},
        recorder={"y": "record_digest"},
        start=[activate("digest"), activate("widths", every="2 ms")],
    )


@graph()
def truth_values(stage: Stage) -> Graph:
    """Two square waves on two processors, and logic that combines them on a third."""
    code = stage.code
    u = [stage.svv(f"u{n}", "bool") for n in range(2)]
    return Graph(
        blocks={
            "a": code.square(half=7),
            "b": code.square(half=11),
            "both": lib.block("logic_and")(n=2),
            "one": lib.block("logic_xor")(n=2),
        },
        cells={},
        objects={"u0": "a.y", "u1": "b.y", "u": ["both.u", "one.u"]},
        arguments={"u0": u[0], "u1": u[1], "u": u},
        place={"a": "0.fast", "b": "1.fast", "both": "2.soft", "one": "2.soft"},
        record={"both": "both.y", "one": "one.y"},
        recorder={"both": "record_bool", "one": "record_bool"},
        start=[activate("both"), activate("one"), activate("a", every="2 ms"), activate("b", every="2 ms")],
    )
