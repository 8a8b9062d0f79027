// SPDX-License-Identifier: Apache-2.0
// Objects drawn with a machine: frames of its bodies, a ghost at its target, the path of a body, contact forces. All of them show the time
// of the cursor.

import { AxesHelper, Box3, BufferGeometry, Color, Group, Line, LineBasicMaterial, Sphere, Vector3 } from "three";
import { Attempts, askUntilAnswered } from "../../control/asking";
import { type Refusal, refusalsOf } from "../../control/refusals";
import type { Geometry } from "../../control/shapes";
import type { Source } from "../../control/source";
import { colour } from "../../design/colours";
import { tr } from "../../language/text";
import { MOVE_MS } from "../../live/values";
import { ContactArrows } from "./contacts";
import { type Aim, aimed, buildGhost } from "./ghost";
import { type BuiltMachine, disposeMachine } from "./machine";
import type { DrawnObjects } from "./PathAndGhost";
import type { Stage } from "./stage";
import { LivePath, type Place, placeOf, RecordedPath } from "./trail";

export interface Scene {
  control: Source;
  geometry: Geometry;
  machine: BuiltMachine;
  stage: Pick<Stage, "add" | "remove" | "draw">;
  /** Data attributes that describe the drawing: number of positions in the path, whether the ghost is shown, number of contacts. */
  told: DOMStringMap;
}

/** Receives the reasons for which an object cannot be drawn; none as soon as it is drawn. */
type Tell = (refusals: Refusal[]) => void;

/** Draws the objects until the returned function is called. `tell` is called with the reasons if an object cannot be drawn. */
export function drawBeside(scene: Scene, drawn: DrawnObjects, tell: Tell): () => void {
  const over = new AbortController();
  const ends: (() => void)[] = [];
  // One object that is drawn does not hide why another is not.
  const refusals: Record<"path" | "ghost", Refusal[]> = { path: [], ghost: [] };
  const tellOf =
    (object: "path" | "ghost"): Tell =>
    (of) => {
      refusals[object] = of;
      const others = refusals.ghost.filter((one) => !refusals.path.some((known) => known.message === one.message));
      tell([...refusals.path, ...others]);
    };
  if (drawn.frames) ends.push(drawFrames(scene));
  if (drawn.force_N !== null && scene.geometry.contacts) ends.push(drawContacts(scene, scene.geometry.contacts, drawn.force_N));
  if (drawn.path_s > 0 && drawn.body !== null) ends.push(drawPath(scene, drawn.body, drawn.path_s * 1e9, over.signal, tellOf("path")));
  if (drawn.ghost) ends.push(drawGhost(scene, drawn.ghost, tellOf("ghost")));
  return () => {
    over.abort();
    for (const end of ends) end();
    scene.stage.draw();
  };
}

function drawFrames({ machine, stage }: Scene): () => void {
  const { radius } = new Box3().setFromObject(machine.root).getBoundingSphere(new Sphere());
  const frames = [...machine.bodies.values()].map((body) => {
    const axes = new AxesHelper(radius > 0 ? 0.15 * radius : 0.1);
    body.add(axes);
    return axes;
  });
  stage.draw();
  return () => {
    for (const axes of frames) {
      axes.removeFromParent();
      axes.dispose();
    }
  };
}

function drawContacts({ control, stage, told }: Scene, svv: string, force_N: number): () => void {
  const arrows = new ContactArrows(force_N, new Color(colour("--bad")));
  stage.add(arrows.root);
  const end = control.values.watch(
    svv,
    (reading) => {
      const numbers = reading?.value;
      told.contacts = String(arrows.put(Array.isArray(numbers) ? numbers.map(Number) : []));
      stage.draw();
    },
    MOVE_MS,
  );
  return () => {
    end();
    delete told.contacts;
    stage.remove(arrows.root);
    arrows.dispose();
  };
}

function drawGhost(scene: Scene, aim: Aim, tell: Tell): () => void {
  const { past } = scene.control;
  let end = () => {};
  const put = (isKnown: (name: string) => boolean) => {
    end();
    const there = aimed(scene.geometry, aim, scene.control.topics.installed.get()?.instances ?? [], isKnown);
    end = there ? putGhost(scene, aim, there) : () => {};
    tell(there ? [] : refusalsOf(new Error(tr("devices.noJointOfThisMachineHas", { aim }))));
  };
  if (past) put((name) => past.channel(name) !== undefined);
  const withdraw = past
    ? () => {}
    : askUntilAnswered(scene.control, {
        ask: (signal) => scene.control.look("names", {}, signal),
        take: ({ svvs }) => {
          const known = new Set(svvs);
          put((name) => known.has(name));
        },
        failed: (why) => tell(refusalsOf(why)),
      });
  return () => {
    withdraw();
    end();
  };
}

function putGhost({ control, stage, told }: Scene, aim: Aim, there: Geometry): () => void {
  const ghost = buildGhost(there);
  const untold = new Set(ghost.joints.map((joint) => joint.svv));
  ghost.root.visible = false;
  stage.add(ghost.root);
  const ends = ghost.joints.map((joint) =>
    control.values.watch(
      joint.svv,
      (reading) => {
        if (typeof reading?.value !== "number") return;
        joint.move(reading.value);
        untold.delete(joint.svv);
        ghost.root.visible = untold.size === 0;
        if (ghost.root.visible) told.ghost = aim;
        stage.draw();
      },
      MOVE_MS,
    ),
  );
  return () => {
    for (const end of ends) end();
    delete told.ghost;
    stage.remove(ghost.root);
    disposeMachine(ghost.root);
  };
}

/** The path, drawn as two lines: one up to the cursor, and a fainter one after it. */
class PathLines {
  readonly root = new Group();
  readonly #before = line(1);
  readonly #behind = line(0.35);

  constructor() {
    this.root.add(this.#before, this.#behind);
  }

  put(places: readonly Place[], cursor_ns: number): void {
    const passed = places.filter((place) => place.time_ns <= cursor_ns);
    setPoints(this.#before, passed);
    setPoints(this.#behind, places.slice(Math.max(0, passed.length - 1)));
  }

  dispose(): void {
    for (const one of [this.#before, this.#behind]) {
      one.geometry.dispose();
      one.material.dispose();
    }
  }
}

function line(opacity: number): Line<BufferGeometry, LineBasicMaterial> {
  const material = new LineBasicMaterial({ color: new Color(colour("--accent")), transparent: opacity < 1, opacity });
  return new Line(new BufferGeometry(), material);
}

function setPoints(of: Line, places: readonly Place[]): void {
  of.geometry.dispose();
  of.geometry = new BufferGeometry().setFromPoints(places.length > 1 ? places.map((place) => place.at) : [new Vector3(), new Vector3()]);
  of.visible = places.length > 1;
}

function drawPath(scene: Scene, body: string, span_ns: number, signal: AbortSignal, tell: Tell): () => void {
  const lines = new PathLines();
  scene.stage.add(lines.root);
  const put = (places: readonly Place[], cursor_ns: number) => {
    lines.put(places, cursor_ns);
    scene.told.path = String(places.length);
    scene.stage.draw();
  };
  const end = scene.control.past ? followCursor(scene, body, span_ns, signal, put, tell) : followSystem(scene, body, span_ns, put);
  return () => {
    end();
    delete scene.told.path;
    scene.stage.remove(lines.root);
    lines.dispose();
  };
}

type PutPath = (places: readonly Place[], cursor_ns: number) => void;

function followSystem({ control, machine }: Scene, body: string, span_ns: number, put: PutPath): () => void {
  const path = new LivePath(span_ns);
  let frame = 0;
  let newest_ns = Number.NaN;
  // Waits for an animation frame, so that all joints have moved to the same time.
  const soon = (time_ns: number) => {
    newest_ns = time_ns;
    frame ||= requestAnimationFrame(() => {
      frame = 0;
      if (machine.root.visible) put(path.add(newest_ns, placeOf(machine, body)), newest_ns);
    });
  };
  const ends = machine.joints.map((joint) => control.values.watch(joint.svv, (reading) => reading && soon(reading.time_ns), MOVE_MS));
  return () => {
    cancelAnimationFrame(frame);
    for (const end of ends) end();
  };
}

function followCursor(
  { control, geometry }: Scene,
  body: string,
  span_ns: number,
  signal: AbortSignal,
  put: PutPath,
  tell: Tell,
): () => void {
  const { past } = control;
  if (!past) return () => undefined;
  const path = new RecordedPath(past, geometry, body, span_ns);
  let looking = false;
  let attempts = new Attempts();
  let hasTold = false;
  let again: ReturnType<typeof setTimeout> | undefined;
  // Only one request is under way at a time: the cursor may have moved meanwhile.
  const look = async () => {
    if (looking) return;
    looking = true;
    for (let asked = Number.NaN; asked !== past.cursor.get() && !signal.aborted; ) {
      asked = past.cursor.get();
      const places = await path.around(asked, signal);
      if (signal.aborted) return;
      put(places, asked);
      if (hasTold) tell([]);
      hasTold = false;
      attempts = new Attempts();
    }
    looking = false;
  };
  const soon = () => {
    look().catch((why) => {
      looking = false;
      if (signal.aborted) return;
      tell(refusalsOf(why));
      hasTold = true;
      const wait_ms = attempts.againAfter_ms(why);
      clearTimeout(again);
      if (wait_ms !== null) again = setTimeout(soon, wait_ms);
    });
  };
  soon();
  // Another position is another question.
  const forget = past.cursor.watch(() => {
    clearTimeout(again);
    attempts = new Attempts();
    soon();
  });
  return () => {
    clearTimeout(again);
    forget();
  };
}
