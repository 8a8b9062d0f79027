// SPDX-License-Identifier: Apache-2.0

import { useEffect, useRef, useState } from "react";
import { askUntilAnswered } from "../../control/asking";
import { type Refusal, RefusalError, refusalsOf } from "../../control/refusals";
import type { Geometry } from "../../control/shapes";
import { Panel, Refusals } from "../../design/parts";
import { tr } from "../../language/text";
import { Age } from "../../live/Age";
import { MOVE_MS } from "../../live/values";
import { useControl } from "../../shell/context";
import { drawBeside, type Scene } from "./beside";
import { buildMachine } from "./machine";
import { type DrawnObjects, PathAndGhost } from "./PathAndGhost";
import { Stage, type Viewpoint } from "./stage";
import { toolOf } from "./trail";

const NOTHING: DrawnObjects = { path_s: 0, body: null, ghost: null, frames: false, force_N: null };

/** A physical device with a geometry, drawn in its current pose; empty if it has no geometry. */
export default function Machine(props: { device: string; lost: string | null }) {
  const { device } = props;
  const control = useControl();
  const place = useRef<HTMLDivElement>(null);
  const stage = useRef<Stage | null>(null);
  const [geometry, setGeometry] = useState<Geometry | null>(null);
  const [still, setStill] = useState<string[]>([]);
  const [isPlaced, setPlaced] = useState(false);
  const [trouble, setTrouble] = useState<Refusal[]>([]);
  const [scene, setScene] = useState<Scene | null>(null);
  const [drawn, setDrawn] = useState(NOTHING);
  const [undrawn, setUndrawn] = useState<Refusal[]>([]);

  useEffect(() => {
    return askUntilAnswered(control, {
      ask: (signal) => control.look("geometry", { device }, signal),
      take: (found) => {
        setGeometry(found);
        setTrouble([]);
      },
      failed: (why) => {
        // A device without a geometry is not an error: a table of signals has none.
        if (!(why instanceof RefusalError && why.is("InvalidState") && !why.isFault)) setTrouble(refusalsOf(why));
      },
    });
  }, [control, device]);

  useEffect(() => {
    if (!geometry || !place.current) return;
    let drawn: Stage;
    const machine = buildMachine(geometry);
    try {
      drawn = new Stage(place.current, machine.root);
    } catch (why) {
      setTrouble([
        {
          class: "Graphics",
          message: tr("devices.thisBrowserCannotDrawIn3", { part: why instanceof Error ? why.message : String(why) }),
          remedy: tr("devices.enableWebGL"),
        },
      ]);
      return;
    }
    stage.current = drawn;
    setStill(machine.still);
    // The machine is hidden until the positions of all joints are known, because the pose of the model is not real.
    const untold = new Set([...machine.joints, ...machine.free].map((joint) => joint.svv));
    const show = () => {
      machine.root.visible = untold.size === 0;
      setPlaced(machine.root.visible);
      drawn.draw();
    };
    show();
    const moved = [
      ...machine.joints.map(({ name, svv, move }) => ({
        name,
        svv,
        put: (value: unknown) => typeof value === "number" && done(move, value),
      })),
      ...machine.free.map(({ name, svv, place }) => ({ name, svv, put: (value: unknown) => isPose(value) && done(place, value) })),
    ];
    const ends = moved.map((joint) =>
      control.values.watch(
        joint.svv,
        (reading, missing) => {
          if (missing) setStill((before) => [...new Set([...before, joint.name])]);
          else if (!reading || !joint.put(reading.value)) return;
          if (untold.delete(joint.svv)) show();
          else drawn.draw();
        },
        MOVE_MS,
      ),
    );
    setScene({ control, geometry, machine, stage: drawn, told: place.current.dataset });
    return () => {
      for (const end of ends) end();
      setScene(null);
      drawn.dispose();
      stage.current = null;
    };
  }, [control, geometry]);

  useEffect(() => {
    if (!scene) return;
    setUndrawn([]);
    const body = drawn.body ?? toolOf(scene.geometry);
    return drawBeside(scene, { ...drawn, body }, setUndrawn);
  }, [scene, drawn]);

  if (!geometry && trouble.length === 0) return null;
  return (
    <Panel
      title={tr("devices.machineDevice", { device })}
      end={(["front", "side", "top"] satisfies Viewpoint[]).map((from) => (
        <button key={from} type="button" className="plain" onClick={() => stage.current?.look(from)}>
          {tr(`devices.view${from}`)}
        </button>
      ))}
      flush
    >
      <Refusals of={[...trouble, ...undrawn]} />
      {props.lost !== null && (
        <p className="stage-note wrong">
          {tr("devices.lostTheLastKnownPositionIs")} <Age of={geometry ? jointsOf(geometry) : []} />
        </p>
      )}
      <div
        className={`stage ${props.lost === null ? "" : "old"}`}
        data-placed={isPlaced ? "yes" : "no"}
        ref={place}
        role="img"
        aria-label={tr("devices.deviceAtTheDisplayedTimeIts", { device })}
      />
      {geometry && !isPlaced && <p className="stage-note quiet small">{tr("devices.waitingForItsPosition")}</p>}
      {geometry && (
        <PathAndGhost
          of={geometry}
          drawn={{ ...drawn, body: drawn.body ?? toolOf(geometry) }}
          put={setDrawn}
          isRecorded={control.past !== null}
        />
      )}
      {still.length > 0 && <p className="stage-note quiet small">{tr("devices.drawnAtThePositionInThe", { still: still.join(", ") })}</p>}
    </Panel>
  );
}

function done<T>(move: (to: T) => void, to: T): true {
  move(to);
  return true;
}

/** Returns whether a value is a pose: x, y, z, then w x y z. */
function isPose(value: unknown): value is number[] {
  return Array.isArray(value) && value.length === 7 && value.every((one) => typeof one === "number");
}

function jointsOf(geometry: Geometry): string[] {
  return geometry.bodies.flatMap((body) => body.joints.flatMap((joint) => joint.svv ?? []));
}
