// SPDX-License-Identifier: Apache-2.0
import { forEach } from "../../control/together";
import { Refusals } from "../../design/parts";
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
    <section className="recovery" aria-label="Recovery" data-step={step}>
      {step === "reset" && <strong className="wrong">Stopped. Remove the cause, then reset.</strong>}
      {step === "enable" && (
        <span>
          {off.length === states.length ? "The drives are off." : `Off: ${off.join(", ")}.`} Enable them, then move to a safe position.
        </span>
      )}
      {step === "ready" && <span className="quiet">Ready</span>}
      {control.may("operate") && (
        <span className="row steps" data-commands>
          <button
            type="button"
            className={step === "reset" ? "primary" : ""}
            disabled={step !== "reset" || action.busy}
            onClick={() => action.run(() => control.order("reset", {}))}
          >
            Reset the stop
          </button>
          <button
            type="button"
            className={step === "enable" ? "primary" : ""}
            disabled={step !== "enable" || action.busy}
            onClick={() => action.run(enable)}
          >
            Enable the drives
          </button>
        </span>
      )}
      <Refusals of={action.refusals} />
    </section>
  );
}
