# SPDX-License-Identifier: Apache-2.0
# Loads a code module and walks its tables; the parent reads one line. A file that crashes a process only crashes this one.
import ctypes, os, resource, sys

resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30))


def say(*words):
    os.write(1, " ".join(str(w).replace("\n", " ") for w in words).encode("utf-8", "replace"))
    os._exit(0)


try:
    module = ctypes.CDLL(sys.argv[1], mode=os.RTLD_NOW | os.RTLD_LOCAL)
except OSError as error:
    say("noload", error)
try:
    entry = module.opengpac_module
except AttributeError:
    say("nosymbol")
entry.restype = ctypes.c_void_p
table = entry()
if not table:
    say("damaged opengpac_module() returned nothing")
u32 = lambda at: ctypes.c_uint32.from_address(at).value
pointer = lambda at: ctypes.c_uint64.from_address(at).value
text = lambda at: ctypes.string_at(pointer(at))
if u32(table) != 2:
    say("abi", u32(table))
blocks, types = u32(table + 4), u32(table + 16)
if blocks > 10000 or types > 10000:
    say("damaged its table of blocks is damaged")
text(table + 32), text(table + 40)
for i in range(types):
    t = pointer(pointer(table + 24) + 8 * i)
    text(t), text(t + 8), text(t + 16)
for i in range(blocks):
    b = pointer(pointer(table + 8) + 8 * i)
    if u32(b) != 2:
        say("abi", u32(b))
    text(b + 8), text(b + 16), text(b + 56)
    if u32(b + 4) > 32 or u32(b + 40) > 1 << 28:
        say("damaged the descriptor of a block is damaged")
    ctypes.string_at(pointer(b + 32), u32(b + 40))
    for j in range(u32(b + 4)):
        for at in (8, 16, 24, 32):
            text(pointer(b + 24) + 64 * j + at)
say("ok")
