# SPDX-License-Identifier: Apache-2.0
# Loads a model with the package `mujoco` and writes the triangles of some of its meshes: for each two counts, then its vertices and its
# faces.

package, path, processor_s, wall_s, *asked = sys.argv[1:]
limit_time(int(processor_s), int(wall_s))
sys.path.insert(0, os.path.dirname(package))

import mujoco

model = mujoco.MjModel.from_xml_path(path)
for mesh in map(int, asked):
    vertices = model.mesh_vert[model.mesh_vertadr[mesh] :][: model.mesh_vertnum[mesh]]
    faces = model.mesh_face[model.mesh_faceadr[mesh] :][: model.mesh_facenum[mesh]]
    for count in (len(vertices), len(faces)):
        sys.stdout.buffer.write(count.to_bytes(8, "little"))
    sys.stdout.buffer.write(vertices.astype("<f4").tobytes() + faces.astype("<u4").tobytes())
