# SPDX-License-Identifier: Apache-2.0
"""OpenGPAC, a general purpose automation controller, configures real-time control programs and changes them while they run.

`System` is a real-time system. `Verb` and `verb` create verbs, `Graph` a data flow graph, and `LogicalDevice` a device type; `load`
reads them from a file. `library` contains the blocks, `drivers` the physical devices, and `robots` ready-made arms.
"""

import importlib
import importlib.util
import sys
from typing import TYPE_CHECKING, Any

from . import _native

__version__ = _native.version()

if TYPE_CHECKING:
    from . import gym as gym
    from .public import *  # noqa: F403
# Driver processes in Python show no tracebacks and offer no motions.
elif "opengpac.driver.process" not in sys.orig_argv:
    from .refusals import tracebacks
    from .studio import offered_motions

    tracebacks.install()
    offered_motions.enters_with(lambda: importlib.import_module(".motion.offering", __name__).enter_for)


def __getattr__(name: str) -> Any:
    """Imports the module of a public name, or a sub-package, on first use."""
    public = importlib.import_module(".public", __name__)

    if name == "__all__":
        return public.__all__
    if (home := public.homes().get(name)) is not None:
        value = getattr(importlib.import_module(f".{home}", __name__), name)
        globals()[name] = value
        return value
    if not name.startswith("_") and importlib.util.find_spec(f".{name}", __name__):
        return importlib.import_module(f".{name}", __name__)
    raise AttributeError(f"module 'opengpac' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted({*globals(), *__getattr__("__all__")})
