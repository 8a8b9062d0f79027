# SPDX-License-Identifier: Apache-2.0
"""OpenGPAC, a general purpose automation controller: configure real-time control programs, and change them while they run.

`System` is a real-time system; `Verb` and `verb` make verbs, `Graph` a data flow graph, `LogicalDevice` a type of devices;
`load` reads them from a file; `library` has the blocks, `drivers` the physical devices, `robots` arms that are ready to use.
"""

import importlib
import importlib.util
import sys
from typing import TYPE_CHECKING, Any

from . import _native

__version__ = _native.version()

# The process of a driver in Python needs four modules of the package and starts in a fifth of the time.
# What else its driver uses is loaded when it is used.
_OF_A_DRIVER = "opengpac.driver.process" in sys.orig_argv

# Their definitions are checked by a real-time system: each is loaded when it is used, and not with the other names.
_WITH_DEFINITIONS = ("cell", "gym", "motion", "robots")

if TYPE_CHECKING:
    from . import gym as gym
    from .public import *  # noqa: F403
elif not _OF_A_DRIVER:
    from . import public
    from .refusals import tracebacks
    from .studio import offered_motions

    tracebacks.install()
    globals().update({name: vars(public)[name] for name in public.__all__ if name not in _WITH_DEFINITIONS})
    offered_motions.enters_with(lambda: importlib.import_module(".motion.offering", __name__).enter_for)


def __getattr__(name: str) -> Any:
    if name in _WITH_DEFINITIONS or (_OF_A_DRIVER and not name.startswith("_") and importlib.util.find_spec(f".{name}", __name__)):
        return importlib.import_module(f".{name}", __name__)
    if name == "__all__" or (_OF_A_DRIVER and not name.startswith("_")):
        public = vars(importlib.import_module(".public", __name__))
        if name in public:
            return public[name]
    raise AttributeError(f"module 'opengpac' has no attribute '{name}'")
