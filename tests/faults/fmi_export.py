# SPDX-License-Identifier: Apache-2.0
"""An FMU of `fmi-export`, a third-party tool, as a block and as a device: both give the results of `fmpy`.

The FMU is built here by that tool, `cargo-fmi`, which takes some minutes and requires libclang (of the package `libclang`); so this
is not part of `make test`.
"""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from fmpy import simulate_fmu
from fmpy.validation import validate_fmu

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).parent / "fmi_export"
STEPS, STEP = 200, 0.01


def built(folder: Path) -> Path:
    """Builds the FMU of `fmi_export/src/lib.rs`."""
    include = subprocess.run(["cc", "-print-file-name=include"], check=True, capture_output=True, text=True).stdout.strip()
    found = importlib.util.find_spec("clang")
    if found is None or found.origin is None:
        sys.exit("there is no libclang: pip install libclang")
    environment = {
        **os.environ,
        "LIBCLANG_PATH": str(Path(found.origin).parent / "native"),
        "BINDGEN_EXTRA_CLANG_ARGS": f"-I{include}",
        "CARGO_TARGET_DIR": str(folder / "built"),
    }
    tool = ["cargo", "install", "--quiet", "cargo-fmi", "--version", "0.3.0", "--locked", "--root", str(folder)]
    subprocess.run(tool, check=True, env=environment, cwd=HERE)
    bundle = [str(folder / "bin" / "cargo-fmi"), "fmi", "--package", "lag", "bundle", "--release"]
    subprocess.run(bundle, check=True, env=environment, cwd=HERE)
    return folder / "built" / "fmu" / "lag.fmu"


def as_a_block(fmu: Path) -> np.ndarray:
    return np.asarray(gpac.fmu(fmu).run(every="10 ms", u=[1.0] * STEPS, tau=0.5).y)


def as_a_device(fmu: Path) -> float:
    """Returns the last value after the same number of steps."""
    with gpac.System("fmi-export", clock="virtual") as cell:
        rtp = cell.processor("rtp0")
        beat = rtp.timer("beat", period="10 ms", priority=80)
        driver = gpac.drivers.fmu(fmu, step="10 ms", parameters={"tau": 0.5})
        plant = rtp.physical_device("lag", driver, exchange=beat)
        push = gpac.Verb(
            "push", blocks={"one": lib.signal_generator(amplitude=0.0, offset=1.0), "write": lib.write_channel},
            cells={"value": ["one.y", "write.u"]}, instantiation_parameters={"u": "write.channel"},
            command_lists={"run": [activate("one", every="10 ms"), activate("write")]},
        )  # fmt: skip
        push.on(beat).asynch(plant["u"])
        cell.advance(f"{STEPS * 10} ms")
        return float(cell.read(plant["y"])[0])


def main() -> int:
    folder = ROOT / "target" / "fmi-export"
    folder.mkdir(parents=True, exist_ok=True)
    fmu = built(folder)
    problems = validate_fmu(str(fmu))
    peer = simulate_fmu(str(fmu), stop_time=STEPS * STEP, output_interval=STEP, step_size=STEP, start_values={"u": 1.0, "tau": 0.5})["y"]
    block, device = as_a_block(fmu), as_a_device(fmu)
    apart = float(np.abs(block - peer[:STEPS]).max())
    ahead = float(np.abs(peer - device).min())
    print(f"{STEPS} steps: as a block {apart:.1e} from fmpy's at most, as a device {ahead:.1e}; {problems or 'no problem'}")
    return int(apart > 1e-12 or ahead > 1e-12 or abs(device - peer[-1]) > 0.01 or bool(problems))


if __name__ == "__main__":
    sys.exit(main())
