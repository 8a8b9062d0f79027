// SPDX-License-Identifier: Apache-2.0
// Contacts of a machine as arrows: from the position of each, along the force of its first shape on its second.
import { ArrowHelper, type Color, Group, Vector3 } from "three";

/** Number of values per contact: x, y, z in m, then the force in N. */
const TOLD = 6;
/** Length of the arrow for the reference force, m. */
export const CHOSEN_M = 0.1;
/** Length of an arrow's head, as a fraction of the arrow, and its maximum, m. */
const HEAD = 0.3;
const HEAD_MAX_M = 0.03;

export interface Arrow {
  from: Vector3;
  along: Vector3;
  length_m: number;
}

/**
 * Returns the arrows of the contacts, scaled so that a force of `chosen_N` has the length [`CHOSEN_M`]. Contacts without a force are
 * omitted.
 */
export function arrowsOf(told: readonly number[], chosen_N: number): Arrow[] {
  const arrows: Arrow[] = [];
  for (let at = 0; at + TOLD <= told.length; at += TOLD) {
    const [x = 0, y = 0, z = 0, fx = 0, fy = 0, fz = 0] = told.slice(at, at + TOLD);
    const force = new Vector3(fx, fy, fz);
    const newtons = force.length();
    if (!(newtons > 0)) continue;
    arrows.push({ from: new Vector3(x, y, z), along: force.divideScalar(newtons), length_m: (CHOSEN_M * newtons) / chosen_N });
  }
  return arrows;
}

/** Creates an arrow that is visible through bodies, because contacts lie inside them. */
function arrow(colour: Color): ArrowHelper {
  const helper = new ArrowHelper(undefined, undefined, 1, colour);
  for (const part of [helper.line, helper.cone]) {
    part.renderOrder = 1;
    for (const material of [part.material].flat()) material.depthTest = false;
  }
  return helper;
}

/** Arrows in a scene; surplus ones are hidden and reused. */
export class ContactArrows {
  readonly root = new Group();
  readonly #chosen_N: number;
  readonly #colour: Color;

  constructor(chosen_N: number, colour: Color) {
    this.#chosen_N = chosen_N;
    this.#colour = colour;
  }

  /** Draws the contacts and returns the number of arrows. */
  put(told: readonly number[]): number {
    const arrows = arrowsOf(told, this.#chosen_N);
    while (this.root.children.length < arrows.length) this.root.add(arrow(this.#colour));
    this.root.children.forEach((child, at) => {
      const of = arrows[at];
      child.visible = of !== undefined;
      if (!of || !(child instanceof ArrowHelper)) return;
      child.position.copy(of.from);
      child.setDirection(of.along);
      const head = Math.min(HEAD * of.length_m, HEAD_MAX_M);
      child.setLength(of.length_m, head, head / 2);
    });
    return arrows.length;
  }

  dispose(): void {
    for (const child of this.root.children) if (child instanceof ArrowHelper) child.dispose();
  }
}
