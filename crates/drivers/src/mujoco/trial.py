# SPDX-License-Identifier: Apache-2.0
# Loads a model and computes it once; the parent reads the output. A crash of MuJoCo only ends this process.
import ctypes

library, model, processor_s, wall_s = sys.argv[1:]


def say(*words):
    os.write(1, b" ".join(words))
    os._exit(0)


@ctypes.CFUNCTYPE(None, ctypes.c_void_p)
def receive(message):
    if ctypes.c_int.from_address(message).value >= 3:
        say(b"fatal", ctypes.string_at(message + 8))


mujoco = ctypes.CDLL(library)
mujoco.mju_setLogHandler(receive)
mujoco.mj_loadXML.restype = mujoco.mj_makeData.restype = ctypes.c_void_p
mujoco.mj_makeData.argtypes = [ctypes.c_void_p]
mujoco.mj_forward.argtypes = [ctypes.c_void_p, ctypes.c_void_p]
problem = ctypes.create_string_buffer(1000)
os.write(1, b"trying ")
limit_time(int(processor_s), int(wall_s))
loaded = mujoco.mj_loadXML(os.fsencode(model), None, problem, len(problem))
if not loaded:
    say(b"refused", problem.value)
data = mujoco.mj_makeData(loaded)
if not data:
    say(b"fatal no memory holds its data")
mujoco.mj_forward(loaded, data)
say(b"sound")
