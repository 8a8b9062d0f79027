# SPDX-License-Identifier: Apache-2.0
"""A Linux of one's own, as a process (Debian's `user-mode-linux`): where a test needs what the kernel of this machine has not, as vcan."""

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
"""The first process of a Linux with a virtual CAN bus; with the word `try` it makes the bus, and ends."""

# What the Linux of a process gives back to another one's registers must be all of them, and it knows fewer than new processors have.
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
    """Why there is none with a virtual CAN bus on this machine; None: there is one. It is tried once since the machine was started."""
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
    """What a Linux that only makes its bus fails with; nothing where it does not."""
    try:
        with tempfile.TemporaryDirectory() as folder:
            failed = run(GUEST, Path(folder), "try", seconds=120).get("failed", "")
    except (AssertionError, OSError, ValueError, subprocess.SubprocessError) as why:
        failed = str(why)
    return failed and f"user-mode Linux does not give one here: {failed.strip().splitlines()[-1]}"


def run(script: Path, folder: Path, *words: str, seconds: int = 300) -> dict[str, Any]:
    """Runs a script of Python as the first process of a new Linux, on the files of this machine, with the path of `folder` and these words.

    What it says there in `said.json` comes back."""
    library = folder / "registers.so"
    (folder / "registers.c").write_text(REGISTERS)
    subprocess.run(["cc", "-shared", "-fPIC", "-O1", "-o", library, folder / "registers.c", "-ldl"], check=True)
    command = ["linux.uml", "mem=768M", "quiet", "rootfstype=hostfs", "rw", "con=null", "con0=null,fd:1", "ssl=null"]
    command += [f"uml_dir={folder}", f"init={sys.executable}", "--", str(script), str(folder), *words]
    # Its own temporary files need a folder that is mapped from the disk.
    environment = {**os.environ, "LD_PRELOAD": str(library), "HOME": str(folder), "TMPDIR": str(folder)}
    ran = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=seconds, env=environment)
    said = folder / "said.json"
    assert said.exists(), f"it ended with {ran.returncode} and said nothing:\n{ran.stdout[-4000:]}\n{ran.stderr[-2000:]}"
    return json.loads(said.read_text())
