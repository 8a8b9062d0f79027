# SPDX-License-Identifier: Apache-2.0
"""Saves and loads definitions, and compares two of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import opengpac as gpac
from opengpac.definition.blocks import Block
from opengpac.definition.files.trees import graph_tree, verb_tree


def said(definition: Any) -> Any:
    """Returns the contents of a definition, without its line numbers."""
    if isinstance(definition, gpac.ComposedVerb):
        composition = definition.composition
        steps = [(step.origins, step.condition, step.to) for step in composition.steps]
        whole = (
            composition.initial,
            dict(composition.rename),
            composition.preset,
            composition.share,
            composition.together,
            composition.doc,
        )
        return verb_tree(definition), steps, whole, {label: said(part) for label, part in composition.parts.items()}
    return graph_tree(definition) if isinstance(definition, gpac.Graph) else verb_tree(definition)


def classes(definition: Any) -> list[type]:
    """Returns the exception classes that a program passes for a definition."""
    return [t.raises for t in definition.conditions.values() if t.raises is not None] if isinstance(definition, gpac.Verb) else []


def devices(definition: Any) -> list[type]:
    return [obj.device_type for obj in definition.objects.values()] if isinstance(definition, gpac.Verb) else []


def modules(definition: Any) -> dict[str, dict[str, Block]]:
    """Returns the code modules of a definition's blocks, as a program would pass them."""
    found: dict[str, dict[str, Block]] = {}

    def look(of: Any) -> None:
        for use in of.blocks.values():
            if isinstance(use.block, gpac.Graph):
                look(use.block)
            elif use.block.system is not None or use.block.module != "library":
                module, name = use.block.name.split(".", 1)
                found.setdefault(module, {})[name] = use.block

    look(definition)
    return found


def forms(definition: Any) -> list[Any]:
    inputs = definition.input_parameters.values() if isinstance(definition, gpac.Verb) else ()
    return [parameter.form for parameter in inputs if parameter.form is not None]


def reloaded(definition: Any, path: Path) -> Any:
    """Saves a definition and returns it as loaded from the file."""
    definition.save(path)
    given: Any = {"raises": classes(definition), "devices": devices(definition), "forms": forms(definition), "modules": modules(definition)}
    return gpac.load(path, **given)[definition.name]
