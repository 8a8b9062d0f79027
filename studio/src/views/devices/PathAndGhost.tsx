// SPDX-License-Identifier: Apache-2.0

import type { Geometry } from "../../control/shapes";
import { Choice } from "../../design/Choice";
import { tr, trWord } from "../../language/text";
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
    <div className="row stage-tools" role="group" aria-label={tr("devices.drawnWithTheMachine")}>
      <Choice
        label={tr("devices.path")}
        value={String(drawn.path_s)}
        title={props.isRecorded ? tr("devices.lengthOfThePathBeforeThe") : tr("devices.lengthOfThePastPath")}
        put={(path) => put({ ...drawn, path_s: Number(path) })}
      >
        {SPANS_S.map((span) => (
          <option key={span} value={span}>
            {span === 0 ? tr("devices.none") : `${span} s`}
          </option>
        ))}
      </Choice>
      {drawn.path_s > 0 && (
        <Choice label={tr("devices.of")} value={drawn.body ?? ""} put={(body) => put({ ...drawn, body })}>
          {of.bodies.slice(1).map(({ name }) => (
            <option key={name}>{name}</option>
          ))}
        </Choice>
      )}
      <Choice
        label={tr("devices.ghost")}
        value={drawn.ghost ?? ""}
        title={tr("devices.theMachineAtTheCommandedPosition")}
        put={(ghost) => put({ ...drawn, ghost: AIMS.find((aim) => aim === ghost) ?? null })}
      >
        <option value="">{tr("devices.none")}</option>
        {AIMS.map((aim) => (
          <option key={aim} value={aim}>
            {trWord(aim)}
          </option>
        ))}
      </Choice>
      {of.contacts && (
        <Choice
          label={tr("devices.forces")}
          value={String(drawn.force_N ?? "")}
          title={tr("devices.arrowsAtContactsAlongTheForce")}
          put={(force) => put({ ...drawn, force_N: force === "" ? null : Number(force) })}
        >
          <option value="">{tr("devices.none")}</option>
          {FORCES_N.map((force) => (
            <option key={force} value={force}>
              {tr("devices.forceNAs10Cm", { force })}
            </option>
          ))}
        </Choice>
      )}
      <label>
        <input type="checkbox" checked={drawn.frames} onChange={(event) => put({ ...drawn, frames: event.target.checked })} />{" "}
        {tr("devices.frames")}
      </label>
    </div>
  );
}
