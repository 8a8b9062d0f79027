# SPDX-License-Identifier: Apache-2.0
"""Objects that accept assignments only to declared names, so that `cell.overide = 0.0` does not succeed silently."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Any, ClassVar

from ..errors import CallError, did_you_mean, refuse

_PACKAGE = __name__.partition(".")[0]


class _Whole(type):
    """Marks each object as complete after its constructor; before that, every assignment declares an attribute."""

    if not TYPE_CHECKING:

        def __call__(cls, *args, **kwargs):
            made = super().__call__(*args, **kwargs)
            made._whole = True
            return made

        @property
        def __signature__(cls):
            own = inspect.signature(cls.__init__)
            return own.replace(parameters=[*own.parameters.values()][1:])


class DeclaredNames(metaclass=_Whole):
    """Base of classes that refuse an assignment to an undeclared name, and suggest the name that was probably meant.

    Declared names are properties with a setter, members of a device type, and the names in `_settable`. A user-defined class may set
    any attribute in its constructor, and again later.
    """

    _settable: ClassVar[frozenset[str]] = frozenset()
    _whole = False

    def __setattr__(self, name: str, value: Any) -> None:
        if not name.startswith("_") and self._whole and not self._takes(name):
            self._refuse_assignment(name)
        object.__setattr__(self, name, value)

    def _takes(self, name: str) -> bool:
        """Returns whether an assignment to that name is valid."""
        kind = type(self)
        if name in kind._settable:
            return True
        found = inspect.getattr_static(kind, name, None)
        if found is not None and hasattr(type(found), "__set__"):
            return not isinstance(found, property) or found.fset is not None
        return _of_user(kind, name) or (name in vars(self) and not _packaged(kind))

    def _refuse_assignment(self, name: str) -> None:
        what, found = self._called(), inspect.getattr_static(type(self), name, None)
        if inspect.isfunction(found):
            refuse(CallError, f"'{name}' of {what} is a method and cannot be assigned", f"write {name}(…)")
        if found is not None or name in vars(self):
            refuse(CallError, f"'{name}' of {what} is read-only", self._instead(name))
        meant = did_you_mean(name, [n for n in dict.fromkeys(dir(self)) if not n.startswith("_") and self._takes(n)])
        is_near, instead = meant.startswith("did you mean"), self._instead(name)
        # A similar name is more helpful than a list of members.
        remedy = meant if is_near and (not instead or instead.startswith("there ")) else instead
        refuse(CallError, f"{what} has no member '{name}'", remedy)

    def _instead(self, name: str) -> str:
        """Returns a suggestion to replace an assignment to that name, or an empty text."""
        return ""

    def _called(self) -> str:
        """Returns the object's name in a message: `system 'cell'`."""
        return f"{type(self).__name__.lower()} '{getattr(self, 'name', '')}'"


def _packaged(kind: type) -> bool:
    return kind.__module__.partition(".")[0] == _PACKAGE


def _of_user(kind: type, name: str) -> bool:
    """Returns whether a class outside this package declares the name, by a value or just by an annotation."""
    own = [base for base in kind.__mro__ if not _packaged(base) and base is not object]
    return any((name in vars(base) and not inspect.isroutine(vars(base)[name])) or name in inspect.get_annotations(base) for base in own)
