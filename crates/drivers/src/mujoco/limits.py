# SPDX-License-Identifier: Apache-2.0
# Resource limits of a child process that reads a model; `trial.py` or `meshes.py` follows.
import os, resource, signal, sys

memory = min(8 << 30, os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 2)
resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
for ends in (signal.SIGALRM, signal.SIGXCPU):
    signal.signal(ends, signal.SIG_DFL)


def limit_time(processor_s, wall_s):
    # A machine that is busy with other work makes no model too large; a file that never ends takes no processor time.
    resource.setrlimit(resource.RLIMIT_CPU, (processor_s, processor_s + 5))
    signal.alarm(wall_s)


