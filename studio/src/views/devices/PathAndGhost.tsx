// SPDX-License-Identifier: Apache-2.0
import type { Geometry } from "../../control/shapes";
import { Choice } from "../../design/Choice";
import { AIMS, type Aim } from "./ghost";

/** Objects drawn in addition to the machine. */
export interface DrawnObjects {
  /** Length of the path before the cursor, and in a recording also after it, s; 0 for no path. */
  path_s: number;
  body: string | null;
  ghost: Aim | null;
  frames: boolean;
  /** Contact force whose arrow is 10 cm long, N; null for no arrows. */
  force_N: number | null;
}

const SPANS_S = [0, 1, 5, 20, 60];
const FORCES_N = [1, 10, 100, 1000];

/** Controls for the additional objects: path, ghost, forces, frames. */
export function PathAndGhost(props: { of: Geometry; drawn: DrawnObjects; put: (drawn: DrawnObjects) => void; isRecorded: boolean }) {
  const { of, drawn, put } = props;
  return (
    <div className="row stage-tools" role="group" aria-label="Drawn with the machine">
      <Choice
        label="Path"
        value={String(drawn.path_s)}
        title={props.isRecorded ? "Length of the path before the cursor, and fainter after it" : "Length of the past path"}
        put={(path) => put({ ...drawn, path_s: Number(path) })}
      >
        {SPANS_S.map((span) => (
          <option key={span} value={span}>
            {span === 0 ? "none" : `${span} s`}
          </option>
        ))}
      </Choice>
      {drawn.path_s > 0 && (
        <Choice label="of" value={drawn.body ?? ""} put={(body) => put({ ...drawn, body })}>
          {of.bodies.slice(1).map(({ name }) => (
            <option key={name}>{name}</option>
          ))}
        </Choice>
      )}
      <Choice
        label="Ghost"
        value={drawn.ghost ?? ""}
        title="The machine at the commanded position of its joints"
        put={(ghost) => put({ ...drawn, ghost: AIMS.find((aim) => aim === ghost) ?? null })}
      >
        <option value="">none</option>
        {AIMS.map((aim) => (
          <option key={aim}>{aim}</option>
        ))}
      </Choice>
      {of.contacts && (
        <Choice
          label="Forces"
          value={String(drawn.force_N ?? "")}
          title="Arrows at contacts, along the force of the first shape on the second; this number of newtons is drawn as 10 cm"
          put={(force) => put({ ...drawn, force_N: force === "" ? null : Number(force) })}
        >
          <option value="">none</option>
          {FORCES_N.map((force) => (
            <option key={force} value={force}>
              {force} N as 10 cm
            </option>
          ))}
        </Choice>
      )}
      <label>
        <input type="checkbox" checked={drawn.frames} onChange={(event) => put({ ...drawn, frames: event.target.checked })} /> frames
      </label>
    </div>
  );
}
