# SPDX-License-Identifier: Apache-2.0
"""Check for FMUs that contain an interpreter, which cannot run on a real-time thread."""

from __future__ import annotations

import re

from ..errors import ModuleError, refuse
from .archive import opened
from .description import Description

_INTERPRETER = re.compile(
    rb"libpython\d[\w.]*\.so|libjvm\.so|libcoreclr\.so|libjulia\.so|libmono[\w.-]*\.so|liblua[\w.-]*\.so|liboctave[\w.-]*\.so"
)
_SCRIPTS = {".py": "Python", ".jar": "Java", ".class": "Java", ".jl": "Julia", ".dll": ".NET"}


def interpreter_in(fmu: Description) -> str:
    """Returns the interpreter in an FMU, or an empty text. Detects it by the libraries that its binary needs, its generating tool, and
    scripts in its resources."""
    with opened(fmu.file) as archive:
        found = _INTERPRETER.search(archive.read(fmu.binary))
    if found is not None:
        return found[0].decode()
    scripts = [entry for entry in fmu.beside if "." in entry and "." + entry.rsplit(".", 1)[1] in _SCRIPTS]
    if scripts and "pythonfmu" in fmu.tool.lower().replace(" ", ""):
        return "Python"
    return ""


def check_native(fmu: Description) -> None:
    """Refuses FMUs that would run an interpreter in a firing."""
    found = interpreter_in(fmu)
    if fmu.needs_tool and not found:
        tool = f" ({fmu.tool})" if fmu.tool else ""
        refuse(ModuleError, f"'{fmu.file.name}' requires the tool that exported it at run time{tool}", "export it as a stand-alone FMU")
    if found:
        text = f"'{fmu.file.name}' runs an interpreter ({found}), which allocates memory and may wait, so it cannot be a block"
        refuse(ModuleError, text, "use it as a device, which runs in a separate process: gpac.drivers.fmu(path, step='10 ms')")
