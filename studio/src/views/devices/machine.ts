// SPDX-License-Identifier: Apache-2.0
// A machine as a tree of three.js objects, with MuJoCo's semantics: each body is attached to its parent and moved by its joints.
import {
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  CapsuleGeometry,
  Color,
  CylinderGeometry,
  Group,
  Mesh,
  MeshStandardMaterial,
  type Object3D,
  SphereGeometry,
  Vector3,
} from "three";
import { toCreasedNormals } from "three/examples/jsm/utils/BufferGeometryUtils.js";
import type { Geometry, GeometryGeom, GeometryJoint } from "../../control/shapes";

/** Angle above which edges are shaded as sharp, rad. */
const CREASE = 0.6;

export interface BuiltMachine {
  root: Group;
  /** Joints whose position is the value of `svv`; `move` takes rad or m. */
  joints: { name: string; svv: string; move: (position: number) => void }[];
  /** Free joints whose pose is the value of `svv`; `place` takes x, y, z in m, then w x y z. */
  free: { name: string; svv: string; place: (pose: readonly number[]) => void }[];
  /** Joints whose position is not published, so they stay as modelled. */
  still: string[];
  /** Objects that move with the bodies, by body name. */
  bodies: ReadonlyMap<string, Object3D>;
}

export function buildMachine(geometry: Geometry): BuiltMachine {
  const root = new Group();
  const inner = new Map<string, Object3D>();
  const built: BuiltMachine = { root, joints: [], free: [], still: [], bodies: inner };
  const meshes = geometry.meshes.map(meshGeometry);
  for (const body of geometry.bodies) {
    const outer = new Group();
    outer.position.set(...body.position);
    turn(outer, body.quaternion);
    ((body.parent !== null && inner.get(body.parent)) || root).add(outer);
    let inside: Object3D = outer;
    for (const joint of body.joints) inside = addJoint(inside, joint, built, outer);
    for (const geom of body.geoms) {
      const shape = shapeOf(geom, meshes);
      if (shape) inside.add(shape);
    }
    inner.set(body.name, inside);
  }
  return built;
}

function turn(object: Object3D, [w, x, y, z]: [number, number, number, number]): void {
  object.quaternion.set(x, y, z, w);
}

/** Adds a joint and returns the object to which the moving parts are attached. */
function addJoint(on: Object3D, joint: GeometryJoint, built: BuiltMachine, body: Object3D): Object3D {
  const moved = new Group();
  on.add(moved);
  if (joint.kind === "free" && joint.svv !== null) {
    // The pose of a free joint is relative to the world, the parent of its body.
    const place = ([x = 0, y = 0, z = 0, w = 1, i = 0, j = 0, k = 0]: readonly number[]) => {
      body.position.set(x, y, z);
      turn(body, [w, i, j, k]);
    };
    built.free.push({ name: joint.name, svv: joint.svv, place });
    return moved;
  }
  if (joint.svv === null || (joint.kind !== "hinge" && joint.kind !== "slide")) {
    built.still.push(joint.name);
    return moved;
  }
  const axis = new Vector3(...joint.axis).normalize();
  const reference = joint.reference ?? 0;
  if (joint.kind === "slide") {
    built.joints.push({
      name: joint.name,
      svv: joint.svv,
      move: (position) => void moved.position.copy(axis).multiplyScalar(position - reference),
    });
    return moved;
  }
  // Moves to the anchor, rotates, and moves back.
  const back = new Group();
  moved.position.set(...joint.position);
  back.position.set(...joint.position).negate();
  moved.add(back);
  built.joints.push({
    name: joint.name,
    svv: joint.svv,
    move: (position) => void moved.quaternion.setFromAxisAngle(axis, position - reference),
  });
  return back;
}

function meshGeometry(mesh: Geometry["meshes"][number]): BufferGeometry {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(mesh.vertices), 3));
  geometry.setIndex(new BufferAttribute(new Uint32Array(mesh.faces), 1));
  return toCreasedNormals(geometry, CREASE);
}

function shapeOf(geom: GeometryGeom, meshes: BufferGeometry[]): Object3D | null {
  const geometry = geometryOf(geom, meshes);
  if (!geometry) return null;
  const [r, g, b, alpha] = geom.rgba;
  const material = new MeshStandardMaterial({
    color: new Color(r, g, b),
    roughness: 0.6,
    metalness: 0.1,
    opacity: alpha,
    transparent: alpha < 1,
  });
  const mesh = new Mesh(geometry, material);
  mesh.position.set(...geom.position);
  turn(mesh, geom.quaternion);
  return mesh;
}

function geometryOf(geom: GeometryGeom, meshes: BufferGeometry[]): BufferGeometry | null {
  const [a = 0, b = 0, c = 0] = geom.size;
  switch (geom.kind) {
    case "sphere":
      return new SphereGeometry(a, 32, 20);
    case "ellipsoid":
      return new SphereGeometry(1, 32, 20).scale(a, b, c);
    case "box":
      return new BoxGeometry(2 * a, 2 * b, 2 * c);
    // The axis of these shapes is z here, but y in three.js.
    case "capsule":
      return new CapsuleGeometry(a, 2 * b, 8, 28).rotateX(Math.PI / 2);
    case "cylinder":
      return new CylinderGeometry(a, a, 2 * b, 36).rotateX(Math.PI / 2);
    // The floor is not drawn: the stage has its own.
    case "plane":
      return null;
    case "mesh":
      return geom.mesh === null ? null : (meshes[geom.mesh] ?? null);
    default:
      return null;
  }
}

/** Frees a machine's graphics memory. */
export function disposeMachine(root: Object3D): void {
  root.traverse((object) => {
    if (!(object instanceof Mesh)) return;
    object.geometry.dispose();
    object.material.dispose();
  });
}
