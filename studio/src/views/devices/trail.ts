// SPDX-License-Identifier: Apache-2.0
// The path of a body: for a running system as it arrives, for a recording around the cursor.
import { Vector3 } from "three";
import type { Geometry } from "../../control/shapes";
import type { Past } from "../../control/source";
import { runsOf } from "../scope/recorded";
import { type BuiltMachine, buildMachine } from "./machine";

/** Position of a body at a time. */
export interface Place {
  time_ns: number;
  at: Vector3;
}

/** Maximum number of positions in a path. */
const PLACES_MAX = 600;
/** Minimum distance between two positions of a path, m. */
const STEP_M = 2e-4;
/** Number of spans fetched on each side, so that a small movement of the cursor needs no request. */
const AHEAD = 2;

/** Returns the body at the end of the longest chain of joints, which is taken as the default tool. */
export function toolOf(geometry: Geometry): string | null {
  const depths = new Map<string, number>();
  let found: string | null = null;
  for (const body of geometry.bodies) {
    const own = body.joints.filter((joint) => joint.kind === "hinge" || joint.kind === "slide").length;
    const depth = (body.parent === null ? 0 : (depths.get(body.parent) ?? 0)) + own;
    depths.set(body.name, depth);
    if (depth > 0 && (found === null || depth >= (depths.get(found) ?? 0))) found = body.name;
  }
  return found;
}

/** Returns the position of a body in the world, in the machine's current pose. */
export function placeOf(machine: BuiltMachine, body: string): Vector3 {
  const found = machine.bodies.get(body);
  if (!found) return new Vector3();
  found.updateWorldMatrix(true, false);
  return found.getWorldPosition(new Vector3());
}

/** The live path: the positions during the most recent span of time. */
export class LivePath {
  readonly #span_ns: number;
  #places: Place[] = [];

  constructor(span_ns: number) {
    this.#span_ns = span_ns;
  }

  /** Adds the current position and returns the path. If time jumps back, the system was restarted, so the path restarts too. */
  add(time_ns: number, at: Vector3): Place[] {
    const last = this.#places.at(-1);
    if (last && time_ns < last.time_ns) this.#places = [];
    if (last && last.at.distanceTo(at) < STEP_M) last.time_ns = Math.max(last.time_ns, time_ns);
    else this.#places.push({ time_ns, at });
    this.#places = this.#places.filter((place) => place.time_ns >= time_ns - this.#span_ns).slice(-PLACES_MAX);
    return this.#places;
  }
}

/** The path in a recording, for which a hidden machine moves through the stored joint positions. */
export class RecordedPath {
  readonly #past: Past;
  readonly #machine: BuiltMachine;
  readonly #body: string;
  readonly #span_ns: number;
  #fetched: { from_ns: number; to_ns: number; places: Place[] } | null = null;

  constructor(past: Past, geometry: Geometry, body: string, span_ns: number) {
    this.#past = past;
    this.#machine = buildMachine({ ...geometry, meshes: [], bodies: geometry.bodies.map((one) => ({ ...one, geoms: [] })) });
    this.#body = body;
    this.#span_ns = span_ns;
  }

  /**
   * Returns the positions from one span before the cursor to one span after it. Throws `RefusalError`, or `AbortError` if `signal`
   * aborts it.
   */
  async around(cursor_ns: number, signal: AbortSignal): Promise<Place[]> {
    const [from_ns, to_ns] = [cursor_ns - this.#span_ns, cursor_ns + this.#span_ns];
    const begins_ns = Math.max(from_ns, this.#past.begins_ns);
    const ends_ns = Math.min(to_ns, this.#past.ends_ns);
    if (!this.#fetched || this.#fetched.from_ns > begins_ns || this.#fetched.to_ns < ends_ns) {
      this.#fetched = await this.#fetch(cursor_ns, signal);
    }
    return this.#fetched.places.filter((place) => place.time_ns >= from_ns && place.time_ns <= to_ns);
  }

  async #fetch(cursor_ns: number, signal: AbortSignal) {
    const from_ns = Math.max(this.#past.begins_ns, Math.round(cursor_ns - AHEAD * this.#span_ns));
    const to_ns = Math.min(this.#past.ends_ns, Math.round(cursor_ns + AHEAD * this.#span_ns));
    const known = this.#machine.joints.filter((joint) => this.#past.channel(joint.svv));
    const channels = known.map((joint) => this.#past.channel(joint.svv) as NonNullable<ReturnType<Past["channel"]>>);
    const stored = known.map(() => ({ times: [] as number[], values: [] as number[] }));
    if (known.length > 0) {
      const names = channels.map((channel) => channel.name);
      for await (const part of this.#past.span(names, from_ns, to_ns, PLACES_MAX, signal)) {
        for (const { channel, times_ns, values } of runsOf(part, channels)) {
          stored[channel]?.times.push(...times_ns);
          stored[channel]?.values.push(...values);
        }
      }
    }
    return { from_ns, to_ns, places: this.#walk(known, stored, from_ns, to_ns) };
  }

  #walk(joints: BuiltMachine["joints"], stored: { times: number[]; values: number[] }[], from_ns: number, to_ns: number): Place[] {
    const places: Place[] = [];
    const at = joints.map(() => -1);
    const steps = Math.min(PLACES_MAX, Math.max(1, ...stored.map(({ times }) => times.length)));
    for (let step = 0; step <= steps; step += 1) {
      const time_ns = from_ns + ((to_ns - from_ns) * step) / steps;
      let isKnown = true;
      joints.forEach((joint, i) => {
        const { times, values } = stored[i] as { times: number[]; values: number[] };
        let now = at[i] as number;
        while (now + 1 < times.length && (times[now + 1] as number) <= time_ns) now += 1;
        at[i] = now;
        if (now < 0) isKnown = false;
        else joint.move(values[now] as number);
      });
      if (!isKnown) continue;
      const place = placeOf(this.#machine, this.#body);
      const last = places.at(-1);
      if (!last || last.at.distanceTo(place) >= STEP_M) places.push({ time_ns, at: place });
    }
    return places;
  }
}
