// SPDX-License-Identifier: Apache-2.0
import { useEffect, useRef, useState } from "react";
import { type Refusal, Refused, refusalsOf } from "../../control/refusals";
import type { Geometry } from "../../control/shapes";
import { Panel, Refusals } from "../../design/parts";
import { MOVE_MS } from "../../live/values";
import { useControl } from "../../shell/context";
import { buildMachine } from "./machine";
import { Stage, type Viewpoint } from "./stage";

/** A physical device that has a shape, drawn as it stands now. Nothing where it has none. */
export default function Machine(props: { device: string; driver: string }) {
  const { device } = props;
  const control = useControl();
  const place = useRef<HTMLDivElement>(null);
  const stage = useRef<Stage | null>(null);
  const [geometry, setGeometry] = useState<Geometry | null>(null);
  const [still, setStill] = useState<string[]>([]);
  const [trouble, setTrouble] = useState<Refusal[]>([]);

  useEffect(() => {
    let over = false;
    control.look("geometry", { device }).then(
      (found) => over || setGeometry(found),
      (why) => {
        // A device without a shape is no fault: a table of signals has none.
        if (!over && !(why instanceof Refused && why.is("InvalidState"))) setTrouble(refusalsOf(why));
      },
    );
    return () => {
      over = true;
    };
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
          message: `this browser draws nothing in 3-D: ${why instanceof Error ? why.message : why}`,
          remedy: "switch WebGL on",
        },
      ]);
      return;
    }
    stage.current = drawn;
    setStill(machine.still);
    const ends = machine.joints.map((joint) =>
      control.values.watch(
        joint.svv,
        (reading) => {
          if (typeof reading?.value !== "number") return;
          joint.move(reading.value);
          drawn.draw();
        },
        MOVE_MS,
      ),
    );
    return () => {
      for (const end of ends) end();
      drawn.dispose();
      stage.current = null;
    };
  }, [control, geometry]);

  if (!geometry && trouble.length === 0) return null;
  return (
    <Panel
      title={`Machine ${device}`}
      end={(["front", "side", "top"] satisfies Viewpoint[]).map((from) => (
        <button key={from} type="button" className="plain" onClick={() => stage.current?.look(from)}>
          {from[0]?.toUpperCase()}
          {from.slice(1)}
        </button>
      ))}
      flush
    >
      <Refusals of={trouble} />
      <div
        className="stage"
        ref={place}
        role="img"
        aria-label={`${device} as it stands now; its joints stand in the table of the devices`}
      />
      {still.length > 0 && (
        <p className="stage-note quiet small">Drawn where the model has them, because nobody tells where they are: {still.join(", ")}</p>
      )}
    </Panel>
  );
}
