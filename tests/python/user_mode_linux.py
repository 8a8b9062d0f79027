# SPDX-License-Identifier: Apache-2.0
"""A private Linux, as a process (Debian's `user-mode-linux`), for tests that need a kernel feature missing on this machine, such as
vcan."""

from __future__ import annotations

import fcntl
import functools
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

GUEST = Path(__file__).parent / "drivers" / "canopen_guest.py"
"""Script that is the first process of a Linux with a virtual CAN bus; with the argument `try` it only creates the bus."""

# User-mode Linux must restore all registers of a process, but it supports fewer than new processors have.
REGISTERS = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/types.h>
#include <sys/uio.h>

#define EXTENDED 0x202

long ptrace(enum __ptrace_request request, ...)
{
    static long (*next)(enum __ptrace_request, ...);
    static char whole[1 << 16];
    va_list rest;
    va_start(rest, request);
    pid_t process = va_arg(rest, pid_t);
    void *at = va_arg(rest, void *), *what = va_arg(rest, void *);
    va_end(rest);
    if (!next) next = (long (*)(enum __ptrace_request, ...))dlsym(RTLD_NEXT, "ptrace");
    if (request != PTRACE_SETREGSET || (uintptr_t)at != EXTENDED) return next(request, process, at, what);
    struct iovec known = *(struct iovec *)what, all = {whole, sizeof whole};
    if (next(PTRACE_GETREGSET, process, at, &all) < 0) return -1;
    memcpy(whole, known.iov_base, known.iov_len < all.iov_len ? known.iov_len : all.iov_len);
    return next(PTRACE_SETREGSET, process, at, &all);
}
"""


@functools.cache
def missing() -> str | None:
    """Returns why a Linux with a virtual CAN bus is unavailable on this machine; `None` if it is available. It is tried once after each
    boot."""
    if shutil.which("linux.uml") is None:
        return "there is no linux.uml: install Debian's user-mode-linux"
    if shutil.which("ip") is None:
        return "there is no ip: install Debian's iproute2"
    boot = Path("/proc/sys/kernel/random/boot_id").read_text().strip()
    known = Path(tempfile.gettempdir()) / f"opengpac-user-mode-linux-{os.getuid()}-{boot}"
    with known.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not known.exists():
            known.write_text(_tried())
    return known.read_text() or None


def _tried() -> str:
    """Returns the error of a Linux that only creates its bus; empty if it succeeds."""
    try:
        with tempfile.TemporaryDirectory() as folder:
            failed = run(GUEST, Path(folder), "try", seconds=120).get("failed", "")
    except (AssertionError, OSError, ValueError, subprocess.SubprocessError) as why:
        failed = str(why)
    return failed and f"user-mode Linux does not give one here: {failed.strip().splitlines()[-1]}"


def run(script: Path, folder: Path, *words: str, seconds: int = 300) -> dict[str, Any]:
    """Runs a Python script as the first process of a new Linux, on the files of this machine, with the path of `folder` and these words
    as arguments.

    Returns the contents of the `said.json` that the script writes there.
    """
    library = folder / "registers.so"
    (folder / "registers.c").write_text(REGISTERS)
    subprocess.run(["cc", "-shared", "-fPIC", "-O1", "-o", library, folder / "registers.c", "-ldl"], check=True)
    command = ["linux.uml", "mem=768M", "quiet", "rootfstype=hostfs", "rw", "con=null", "con0=null,fd:1", "ssl=null"]
    command += [f"uml_dir={folder}", f"init={sys.executable}", "--", str(script), str(folder), *words]
    # Its own temporary files need a folder mapped from the disk.
    environment = {**os.environ, "LD_PRELOAD": str(library), "HOME": str(folder), "TMPDIR": str(folder)}
    ran = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=seconds, env=environment)
    said = folder / "said.json"
    assert said.exists(), f"it ended with {ran.returncode} and said nothing:\n{ran.stdout[-4000:]}\n{ran.stderr[-2000:]}"
    return json.loads(said.read_text())
