# SPDX-License-Identifier: Apache-2.0
# Resource limits of a child process that reads a model; `trial.py` or `meshes.py` follows.
import os, resource, signal, sys

memory = min(8 << 30, os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 2)
resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
signal.signal(signal.SIGALRM, signal.SIG_DFL)

