// SPDX-License-Identifier: Apache-2.0

import { useEffect, useState } from "react";
import { askUntilAnswered } from "../../control/asking";
import { type Refusal, refusalsOf } from "../../control/refusals";
import { Refusals } from "../../design/parts";
import { trNodes } from "../../language/nodes";
import { tr } from "../../language/text";
import { useAction, useControl } from "../../shell/context";
import { type DeviceFamily, shortName } from "./families";
import { BEAT, JOG } from "./jogging";
import { HeldButton, useHeld } from "./useHeld";

export interface JogState {
  /** True if the buttons can be pressed. */
  able: boolean;
  /** Missing requirement for jogging; null if nothing is missing, or if the family has no joints. */
  missing: "verb" | "heartbeat" | null;
  refusals: Refusal[];
  share: number;
  setShare: (share: number) => void;
  press: (device: string, direction: 1 | -1) => void;
  release: () => void;
  look: () => void;
}

/** Returns the jogging state for the joints of a family; checks whether the system meets the requirements. */
export function useJog(family: DeviceFamily): JogState {
  const control = useControl();
  const joints = "jog_speed" in family.type.parameters;
  const [missing, setMissing] = useState<"verb" | "heartbeat" | "unknown">("unknown");
  const [refusals, setRefusals] = useState<Refusal[]>([]);
  const [share, setShare] = useState(50);
  const [ready, setReady] = useState(false);
  const held = useHeld();

  const [looks, setLooks] = useState(0);
  // biome-ignore lint/correctness/useExhaustiveDependencies: `looks` says when to ask again
  useEffect(() => {
    if (!joints || !control.may("operate")) return;
    return askUntilAnswered(control, {
      ask: (signal) => control.look("names", {}, signal),
      take: (names) => {
        const lacks = !names.verbs.includes(JOG) ? "verb" : !names.svvs.includes(BEAT) ? "heartbeat" : null;
        setReady(lacks === null);
        if (lacks) setMissing(lacks);
        setRefusals([]);
      },
      failed: (why) => setRefusals(refusalsOf(why)),
    });
  }, [control, joints, looks]);

  const press = (device: string, direction: 1 | -1) =>
    held.press({ verb: JOG, devices: [device], values: { velocity: `${direction * share} %` } });
  return {
    able: ready,
    missing: joints && !ready && missing !== "unknown" ? missing : null,
    refusals: [...refusals, ...held.refusals],
    share,
    setShare,
    press,
    release: held.release,
    look: () => setLooks((before) => before + 1),
  };
}

/** The two jog buttons of a joint; the joint moves while a button is held with the mouse, a finger, or the space bar. */
export function JogButtons(props: { of: JogState; device: string }) {
  const { of, device } = props;
  const name = shortName(device);
  return (
    <span className="jog" data-commands>
      <HeldButton label={tr("devices.jogNameBackwardWhileHeld", { name })} press={() => of.press(device, -1)} release={of.release}>
        −
      </HeldButton>
      <HeldButton label={tr("devices.jogNameForwardWhileHeld", { name })} press={() => of.press(device, 1)} release={of.release}>
        +
      </HeldButton>
    </span>
  );
}

/** Jogging speed, or the missing requirement and how to meet it. */
export function JogTools(props: { of: JogState }) {
  const { of } = props;
  const control = useControl();
  const action = useAction();
  if (of.missing === "verb") {
    return (
      <p className="jog-tools quiet">
        {trNodes("devices.joggingNeedsTheVerbCodeIn", {
          code: <code>jog</code>,
          code2: <code>motion.jog.new_instance(arm, cell.svv("{BEAT}", int))</code>,
        })}{" "}
        <button type="button" onClick={of.look}>
          {tr("devices.checkAgain")}
        </button>
      </p>
    );
  }
  if (of.missing === "heartbeat") {
    return (
      <div className="jog-tools quiet">
        {trNodes("devices.joggingNeedsTheSVVCodeInto", { code: <code>{BEAT}</code> })}{" "}
        {control.may("configure") ? (
          <button
            type="button"
            data-commands
            disabled={action.busy}
            onClick={() => action.run(() => control.order("svv", { name: BEAT, type_text: "int64_t" }).then(of.look))}
          >
            {tr("devices.create")}
          </button>
        ) : (
          trNodes("devices.aProgramCreatesItCode", { code: <code>cell.svv("{BEAT}", int)</code> })
        )}
        <Refusals of={action.refusals} />
      </div>
    );
  }
  if (!of.able) return null;
  return (
    <label className="jog-tools row">
      <span className="quiet">{tr("devices.jogSpeed")}</span>
      <input type="range" min={5} max={100} step={5} value={of.share} onChange={(event) => of.setShare(Number(event.target.value))} />
      <span className="figures">{of.share} %</span>
      <span className="quiet">{tr("devices.ofJogSpeedAJointMoves")}</span>
    </label>
  );
}
