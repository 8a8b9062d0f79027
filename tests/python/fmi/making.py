# SPDX-License-Identifier: Apache-2.0
"""FMUs for the tests: `lag.c` with the FMI headers that fmpy contains, and descriptions with at most one defect."""

from __future__ import annotations

import functools
import importlib.util
import re
import subprocess
import tempfile
import zipfile
from pathlib import Path

HEADERS = Path(next(iter(importlib.util.find_spec("fmpy").submodule_search_locations))) / "c-code"  # type: ignore[union-attr,arg-type]

VARIABLES_2 = """
<ScalarVariable name="u" valueReference="1" causality="input" description="what goes in"><Real start="0" unit="V"/></ScalarVariable>
<ScalarVariable name="hold" valueReference="7" causality="input" variability="discrete"><Boolean start="false"/></ScalarVariable>
<ScalarVariable name="y" valueReference="2" causality="output" initial="exact"><Real start="0.25" unit="V"/></ScalarVariable>
<ScalarVariable name="count.n" valueReference="5" causality="output" variability="discrete"><Integer/></ScalarVariable>
<ScalarVariable name="on" valueReference="6" causality="output" variability="discrete"><Boolean/></ScalarVariable>
<ScalarVariable name="k" valueReference="3" causality="parameter" variability="fixed"><Real start="2" unit="1"/></ScalarVariable>
<ScalarVariable name="tau" valueReference="4" causality="parameter" variability="fixed"><Real start="0.1" unit="s"/></ScalarVariable>
<ScalarVariable name="gain" valueReference="9" causality="parameter" variability="tunable"><Real start="1"/></ScalarVariable>
<ScalarVariable name="mode" valueReference="8" causality="parameter" variability="fixed"><Integer start="0"/></ScalarVariable>"""

VARIABLES_3 = """
<Float64 name="u" valueReference="1" causality="input" start="0" unit="V"/>
<Boolean name="hold" valueReference="7" causality="input" variability="discrete" start="false"/>
<Float64 name="y" valueReference="2" causality="output" initial="exact" start="0.25" unit="V"/>
<Int32 name="count.n" valueReference="5" causality="output" variability="discrete" initial="exact" start="0"/>
<Boolean name="on" valueReference="6" causality="output" variability="discrete" initial="calculated"/>
<Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>
<Float64 name="k" valueReference="3" causality="parameter" variability="fixed" start="2"/>
<Float64 name="tau" valueReference="4" causality="parameter" variability="fixed" start="0.1" unit="s"/>
<Float64 name="gain" valueReference="9" causality="parameter" variability="tunable" start="1"/>
<Int32 name="mode" valueReference="8" causality="parameter" variability="fixed" start="0"/>"""

UNITS = """<UnitDefinitions><Unit name="1"/><Unit name="furlong"/>
<Unit name="V"><BaseUnit kg="1" m="2" s="-3" A="-1"/></Unit><Unit name="s"><BaseUnit s="1"/></Unit></UnitDefinitions>"""


@functools.cache
def library(version: int) -> bytes:
    """Returns the FMU's binary."""
    with tempfile.TemporaryDirectory() as folder:
        made, rest = Path(folder) / "lag.so", Path(folder) / "rest.c"
        # fmpy requires every function of FMI: those that the lag lacks fail.
        header = (HEADERS / f"fmi{version}Functions.h").read_text()
        names = re.findall(rf"#define (fmi{version}\w+)\s+fmi{version}FullName", header)
        rest.write_text("".join(f"__attribute__((weak)) int {name}(void) {{ return 3; }}\n" for name in names))
        sources = [str(Path(__file__).with_name("lag.c")), str(rest)]
        subprocess.run(["cc", "-O1", "-shared", "-fPIC", f"-DFMI={version}", f"-I{HEADERS}", *sources, "-o", str(made)], check=True)
        return made.read_bytes()


def description(version: int, *, attributes: str = "", told: str = "", token: str = "{lag}", variables: str = "") -> str:
    """Returns an FMU's modelDescription.xml, with the `attributes` of its CoSimulation element and its version `told`."""
    kind, inside = ("guid", VARIABLES_2) if version == 2 else ("instantiationToken", VARIABLES_3)
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="{told or f"{version}.0"}" modelName="lag" {kind}="{token}" description="A lag.">
<CoSimulation modelIdentifier="lag" {attributes or 'canHandleVariableCommunicationStepSize="true"'}/>
{UNITS}<DefaultExperiment startTime="0"/>
<ModelVariables>{variables or inside}</ModelVariables>
{
        '<ModelStructure><Outputs><Unknown index="3"/><Unknown index="4"/><Unknown index="5"/></Outputs></ModelStructure>'
        if version == 2
        else '<ModelStructure><Output valueReference="2"/><Output valueReference="5"/><Output valueReference="6"/></ModelStructure>'
    }
</fmiModelDescription>"""


def lag(
    file: Path, version: int, *, xml: str | None = None, binary: bytes | None = None, folder: str = "", resources: bool = False
) -> Path:
    """Returns an FMU of the lag, a good one unless `xml`, `binary` or `folder` is set. `folder`: the folder of its binary, or "-" for
    none."""
    platform = folder or ("linux64" if version == 2 else "x86_64-linux")
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("modelDescription.xml", description(version) if xml is None else xml)
        if folder != "-":
            archive.writestr(f"binaries/{platform}/lag.so", library(version) if binary is None else binary)
        if resources:
            archive.writestr("resources/table.txt", "1 2 3")
    return file
