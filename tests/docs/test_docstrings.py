# SPDX-License-Identifier: Apache-2.0
"""The docstrings of the public names explain every parameter, and say which call returns an object that a program does not create
itself."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterator
from types import ModuleType
from typing import Any

import pytest

import opengpac as gpac

PUBLIC = {name: getattr(gpac, name) for name in gpac.__all__}
CLASSES = {name: of for name, of in PUBLIC.items() if inspect.isclass(of)}
FUNCTIONS = {name: of for name, of in PUBLIC.items() if inspect.isfunction(of)}


def unnamed(call: Callable[..., Any], doc: str) -> list[str]:
    """Returns the parameters of a call that a docstring does not name."""
    given = [p for p in inspect.signature(call).parameters.values() if p.kind not in (p.VAR_POSITIONAL, p.VAR_KEYWORD)]
    names = [p.name for p in given if p.name not in ("self", "cls")]
    return [name for name in names if not re.search(rf"\b{name}\b", doc)]


def methods(of: type) -> Iterator[tuple[str, Callable[..., Any]]]:
    """Yields the public methods that a class itself defines."""
    yield from ((name, member) for name, member in vars(of).items() if inspect.isfunction(member) and not name.startswith("_"))


MADE_BY = re.compile(r"\b(made by|created by|obtained from|returned by|a call returns it|creates an instance)\b", re.IGNORECASE)
"""Phrases that name the function that makes an object of a class."""


@pytest.mark.parametrize("name", CLASSES)
def test_a_class_says_what_its_constructor_takes_or_what_makes_it(name: str) -> None:
    of = CLASSES[name]
    doc = inspect.cleandoc(of.__doc__ or "")
    assert doc, "a public class has a docstring"
    if MADE_BY.search(doc) or issubclass(of, Exception | tuple | str):
        return
    assert unnamed(of.__init__, doc + (of.__init__.__doc__ or "")) == []


@pytest.mark.parametrize("name", CLASSES)
def test_a_method_names_its_parameters(name: str) -> None:
    found = {called: unnamed(method, inspect.getdoc(method) or "") for called, method in methods(CLASSES[name])}
    assert {called: missing for called, missing in found.items() if missing} == {}
    members = {called: member for called, member in vars(CLASSES[name]).items() if not called.startswith("_")}
    documented = {called: inspect.getdoc(of) for called, of in members.items() if inspect.isfunction(of) or isinstance(of, property)}
    assert [called for called, doc in documented.items() if not doc] == []


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_function_names_its_parameters(name: str) -> None:
    doc = inspect.getdoc(FUNCTIONS[name]) or ""
    assert doc and unnamed(FUNCTIONS[name], doc) == []


def test_every_public_name_is_looked_at() -> None:
    aliases = {"Command", "Quantity"}
    others = {name for name, of in PUBLIC.items() if isinstance(of, ModuleType)} | aliases
    assert PUBLIC.keys() == CLASSES.keys() | FUNCTIONS.keys() | others
    assert unnamed(lambda given, other: None, "`given`: a number") == ["other"], "a gap is found"
