// SPDX-License-Identifier: Apache-2.0
// Queries of the editor to the system: the available blocks, the errors of the draft, the possible wires. All rules are implemented there.
import { useCallback, useEffect, useMemo, useRef, useState } from "react";
import { askUntilAnswered } from "../../../control/asking";
import type { Control } from "../../../control/control";
import { type Refusal, refusalsOf } from "../../../control/refusals";
import { worded } from "../../../control/wording";
import { type Draft, definitionOf } from "./definition";
import type { Face, Faces } from "./faces";
import { type Finding, findingsOf } from "./findings";

/** Time without changes after which the draft is checked, ms. */
const PAUSE_MS = 250;

/** Returns the component data base of the system, its types of logical devices, and its interrupt sources. */
export function useFaces(control: Control): { faces: Faces; device_types: string[]; sources: string[]; trouble: Refusal[] } {
  const [sources, setSources] = useState<string[]>([]);
  const [faces, setFaces] = useState<Faces>(new Map());
  const [device_types, setTypes] = useState<string[]>([]);
  const [trouble, setTrouble] = useState<Refusal[]>([]);
  useEffect(() => {
    return askUntilAnswered(control, {
      ask: (signal) => Promise.all([control.look("library", {}, signal), control.look("names", {}, signal)]),
      take: ([found, names]) => {
        setFaces(new Map((found as Face[]).map((face) => [face.name, face])));
        setTypes(names.device_types);
        setSources(names.sources);
        setTrouble([]);
      },
      failed: (why) => setTrouble(refusalsOf(why)),
    });
  }, [control]);
  return { faces, device_types, sources, trouble };
}

/** Returns the findings of all installation checks of the draft. The checks are repeated a moment after each change. */
export function useFindings(control: Control, draft: Draft): { findings: Finding[]; unanswered: Refusal[] } {
  const [findings, setFindings] = useState<Finding[]>([]);
  const [unanswered, setUnanswered] = useState<Refusal[]>([]);
  const definition = useMemo(() => JSON.stringify({ [draft.kind]: definitionOf(draft) }), [draft]);
  useEffect(() => {
    return askUntilAnswered(control, {
      ask: (signal) => control.look("check_drawing", JSON.parse(definition) as Record<string, unknown>, signal),
      take: (answered) => {
        const found = findingsOf(answered);
        // Equal findings keep the same object, which avoids rendering them again.
        setFindings((before) => (JSON.stringify(before) === JSON.stringify(found) ? before : found));
        setUnanswered([]);
      },
      failed: (why) => setUnanswered(refusalsOf(why)),
      after_ms: PAUSE_MS,
    });
  }, [control, definition]);
  return { findings, unanswered };
}

type At = { block: string; port: string };

export interface Possible {
  /** Queries which ports can be the other end of a wire that starts at this port; null if the wire has ended. */
  ask: (from: At | null) => void;
  /**
   * Returns the reason why two ports cannot be wired; null if they can, or if the answer has not arrived yet, in which case the check
   * reports it.
   */
  reason: (from: At, to: At) => string | null;
}

/** Returns the ports to which a wire may lead. The system is queried when the wire is started, because its installation rules decide. */
export function usePossible(control: Control, draft: Draft): Possible {
  const answer = useRef<{ begun: At; reasons: Map<string, string | null> } | null>(null);
  const latest = useRef(0);
  const ask = useCallback(
    (from: At | null) => {
      // The answer is kept after the wire ends: a refused wire still needs the reason.
      if (!from) return;
      latest.current += 1;
      const number = latest.current;
      answer.current = null;
      const asked = { [draft.kind]: definitionOf(draft), from };
      control.look("compatible", asked).then(
        (found) => {
          if (number !== latest.current) return;
          const reasons = (found as (At & { reason: string | null })[]).map((one): [string, string | null] => [
            keyOf(one),
            one.reason === null ? null : worded(one.reason),
          ]);
          answer.current = { begun: from, reasons: new Map(reasons) };
        },
        // Without an answer, every wire can be drawn; the check then finds errors.
        () => undefined,
      );
    },
    [control, draft],
  );
  const reason = useCallback((from: At, to: At) => {
    const known = answer.current;
    if (!known) return null;
    const other = keyOf(from) === keyOf(known.begun) ? to : from;
    return known.reasons.get(keyOf(other)) ?? null;
  }, []);
  return useMemo(() => ({ ask, reason }), [ask, reason]);
}

function keyOf(at: At): string {
  return `${at.block}\n${at.port}`;
}
