// SPDX-License-Identifier: Apache-2.0

import { useEffect, useId, useRef, useState } from "react";
import type { Refusal } from "../../control/refusals";
import type { ArmDescription, ChainDescription, DeviceState, Statistics } from "../../control/shapes";
import { Panel, Refusals } from "../../design/parts";
import { tr } from "../../language/text";
import { Age } from "../../live/Age";
import { isStored } from "../../live/stored";
import { useControl } from "../../shell/context";
import { isRenewed } from "./families";
import {
  isTurn,
  notEnabled,
  SPEED_MAX,
  STEPS,
  type Step,
  TOOL_AXES,
  type ToolAxis,
  type ToolJog,
  TURN_MAX,
  toldOfEnd,
  toolMotion,
  whyNot,
} from "./toolJog";
import { rollPitchYaw, toolPose } from "./toolPose";
import { HeldButton, useHeld } from "./useHeld";

const DEGREES = 180 / Math.PI;

/** Tool of an arm: its live pose, and controls to jog it along and about axes. */
export function ToolPanel(props: { of: ArmDescription; now: Statistics }) {
  const { of: arm, now } = props;
  const control = useControl();
  const isFresh = arm.joints.every((joint) => isRenewed(now.devices[joint]));
  const why = whyNot(arm);
  return (
    <Panel
      className={`tool ${isFresh ? "" : "old"}`}
      title={
        <>
          {tr("devices.toolOfName", { name: arm.name })} {!isFresh && <Age of={sensedOf(arm)} />}
        </>
      }
    >
      {arm.chain && <PoseFigures of={arm} chain={arm.chain} />}
      {why !== null && <p className="quiet">{why}</p>}
      {why === null && arm.chain && control.may("operate") && (
        <ToolJogs of={arm} chain={arm.chain} states={arm.joints.map((joint) => now.devices[joint])} />
      )}
    </Panel>
  );
}

function sensedOf(arm: ArmDescription): string[] {
  return arm.joints.map((joint) => `${joint}.sensed`);
}

/** Pose of the tool as numbers, mm and degrees, written into the page without React. */
function PoseFigures(props: { of: ArmDescription; chain: ChainDescription }) {
  const control = useControl();
  const place = useRef<HTMLDListElement>(null);
  const { of: arm, chain } = props;
  useEffect(() => {
    const q = new Map<number, number>();
    let isDue = false;
    const show = () => {
      isDue = false;
      const pose =
        q.size === arm.joints.length
          ? toolPose(
              chain,
              [...arm.joints.keys()].map((joint) => q.get(joint) ?? Number.NaN),
            )
          : null;
      const figures = pose ? [...pose.place.map((x) => 1000 * x), ...rollPitchYaw(pose).map((angle) => DEGREES * angle)] : [];
      for (const [index, axis] of TOOL_AXES.entries()) {
        const shown = place.current?.querySelector(`[data-pose="${axis}"]`);
        // Adding 0 after rounding turns -0 into 0.
        if (shown) shown.textContent = figures[index] === undefined ? "–" : (Math.round(figures[index] * 100) / 100 + 0).toFixed(2);
      }
    };
    const ends = sensedOf(arm).map((name, joint) =>
      control.values.watch(name, (reading) => {
        if (reading && isStored(reading) && typeof reading.value === "number") q.set(joint, reading.value);
        else q.delete(joint);
        // Readings of all joints at one time are delivered one after the other, and shown once.
        if (!isDue) queueMicrotask(show);
        isDue = true;
      }),
    );
    return () => {
      for (const end of ends) end();
    };
  }, [control, arm, chain]);
  return (
    <dl className="pose live" ref={place} aria-label={tr("devices.poseOfTheToolOfName", { name: arm.name })}>
      {TOOL_AXES.map((axis) => (
        <div key={axis}>
          <dt>{axis}</dt>
          <dd>
            <span className="figures" data-pose={axis}>
              –
            </span>
            <span className="quiet">{isTurn(axis) ? "\u202f°" : "\u202fmm"}</span>
          </dd>
        </div>
      ))}
    </dl>
  );
}

function ToolJogs(props: { of: ArmDescription; chain: ChainDescription; states: (DeviceState | undefined)[] }) {
  const { of: arm, chain, states } = props;
  const [inTool, setInTool] = useState(false);
  const [step, setStep] = useState<Step>(0);
  const [share, setShare] = useState(20);
  const [told, setTold] = useState<{ text: string; wrong: Refusal[] }>({ text: "", wrong: [] });
  const held = useHeld((report) => {
    const wrong = toldOfEnd(arm, report);
    setTold({ text: wrong ? "" : tr("devices.stepCompleted"), wrong: wrong ? [wrong] : [] });
  });
  const isStepping = held.under?.isStep === true;
  const press = (axis: ToolAxis, direction: 1 | -1) => {
    if (isStepping) return;
    const jog: ToolJog = { axis, direction, share, inTool, step };
    const asleep = arm.joints.filter((_, index) => !isRenewed(states[index]));
    setTold({ text: "", wrong: asleep.length > 0 ? [notEnabled(asleep)] : [] });
    if (asleep.length > 0) return;
    held.press(toolMotion(arm, chain, jog));
  };
  const isEnabled = states.every(isRenewed);
  const wrong = [...held.refusals, ...told.wrong];
  const said = held.under ? (isStepping ? tr("devices.stepInProgress") : tr("devices.theToolMovesWhileTheButton")) : told.text;
  return (
    <>
      <div className="row tool-choices">
        <Segments
          label={tr("devices.axesOf")}
          value={inTool ? "tool" : "base"}
          put={(value) => setInTool(value === "tool")}
          of={[
            ["base", tr("devices.base")],
            ["tool", tr("devices.tool2")],
          ]}
        />
        <Segments
          label={tr("devices.moves")}
          value={String(step)}
          put={(value) => setStep(STEPS.find((one) => String(one) === value) ?? 0)}
          unit={tr("devices.mmOrDegrees")}
          of={STEPS.map((one) => [String(one), one === 0 ? tr("devices.whileHeld") : String(one)])}
        />
        <label className="row">
          <span className="quiet">{tr("devices.speed")}</span>
          <input type="range" min={5} max={100} step={5} value={share} onChange={(event) => setShare(Number(event.target.value))} />
          <span className="figures tool-speed">
            {Math.round(10 * SPEED_MAX * share)} mm/s, {Math.round((DEGREES * TURN_MAX * share) / 100)} °/s
          </span>
        </label>
      </div>
      <div className="tool-axes" data-commands>
        {TOOL_AXES.map((axis) => (
          <div key={axis} className="tool-axis">
            <span>{axis}</span>
            {([-1, 1] as const).map((direction) => (
              <HeldButton
                key={direction}
                label={labelOf(axis, direction, step)}
                press={() => press(axis, direction)}
                release={held.release}
                isBusy={isStepping}
              >
                {direction > 0 ? "+" : "−"}
              </HeldButton>
            ))}
          </div>
        ))}
      </div>
      {/* One line, whatever it says; what is refused is told over the page. */}
      <p className="tool-told" role="status" aria-label={tr("devices.stateOfJoggingTheToolOf", { name: arm.name })}>
        {said || (isEnabled ? tr("devices.theToolIsAtRest") : tr("devices.enableTheJointsOfTheArm"))}
      </p>
      <Refusals of={wrong} />
    </>
  );
}

function labelOf(axis: ToolAxis, direction: 1 | -1, step: Step): string {
  const way = `${isTurn(axis) ? tr("devices.about") : tr("devices.along")} ${direction > 0 ? "+" : "−"}${axis.replace("R", "")}`;
  return step === 0
    ? tr("devices.jogTheToolWayWhileHeld", { way })
    : tr("devices.stepTheToolWayByStep", { way, step, part: isTurn(axis) ? tr("devices.degrees") : "mm" });
}

/** Choice between a few options that are all visible. */
function Segments(props: { label: string; value: string; put: (value: string) => void; of: [string, string][]; unit?: string }) {
  const name = useId();
  return (
    <fieldset className="segments">
      <legend>{props.label}</legend>
      {props.of.map(([value, text]) => (
        <label key={value}>
          <input type="radio" name={name} value={value} checked={value === props.value} onChange={() => props.put(value)} />
          <span>{text}</span>
        </label>
      ))}
      {props.unit && <span className="segments-unit">{props.unit}</span>}
    </fieldset>
  );
}
