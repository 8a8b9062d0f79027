// SPDX-License-Identifier: Apache-2.0

import { forEach } from "../../control/together";
import { Refusals } from "../../design/parts";
import { tr } from "../../language/text";
import { useAction, useControl, useTopic } from "../../shell/context";

/** Recovery from an emergency stop: reset, then enable. Its height is the same in every state. */
export function Recovery() {
  const control = useControl();
  const action = useAction();
  const now = useTopic(control.topics.statistics);
  const states = Object.entries(now?.devices ?? {});
  const off = states.filter(([, state]) => state === "disabled" || state === "fault").map(([name]) => name);
  const step = !now ? "wait" : now.emergency !== null ? "reset" : off.length > 0 ? "enable" : "ready";
  const enable = () => {
    const pressed = control.pressed();
    return forEach(off, (name) => control.order("enable", { name }, undefined, pressed));
  };
  return (
    <section className="recovery" aria-label={tr("panel.recovery")} data-step={step}>
      {step === "reset" && <strong className="wrong">{tr("panel.stoppedRemoveTheCauseThenReset")}</strong>}
      {step === "enable" && (
        <span>
          {off.length === states.length ? tr("panel.theDrivesAreOff") : tr("panel.offOff", { off: off.join(", ") })}{" "}
          {tr("panel.enableThemThenMoveToA")}
        </span>
      )}
      {step === "ready" && <span className="quiet">{tr("panel.ready")}</span>}
      {control.may("operate") && (
        <span className="row steps" data-commands>
          <button
            type="button"
            className={step === "reset" ? "primary" : ""}
            disabled={step !== "reset" || action.busy}
            onClick={() => action.run(() => control.order("reset", {}))}
          >
            {tr("panel.resetTheStop")}
          </button>
          <button
            type="button"
            className={step === "enable" ? "primary" : ""}
            disabled={step !== "enable" || action.busy}
            onClick={() => action.run(enable)}
          >
            {tr("panel.enableTheDrives")}
          </button>
        </span>
      )}
      <Refusals of={action.refusals} />
    </section>
  );
}
