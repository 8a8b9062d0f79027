// SPDX-License-Identifier: Apache-2.0
import { type KeyboardEvent, useCallback, useEffect, useRef, useState } from "react";
import { type Refusal, refusalsOf } from "../../control/refusals";
import { Refusals } from "../../design/parts";
import { useAction, useControl } from "../../shell/context";
import { type DeviceFamily, shortName } from "./families";
import { BEAT, JOG, Press } from "./jogging";

export interface JogState {
  /** True if its buttons can be pressed. */
  able: boolean;
  /** Reason why they cannot, in words; null: the family has no joints. */
  missing: "verb" | "heartbeat" | null;
  refusals: Refusal[];
  share: number;
  setShare: (share: number) => void;
  press: (device: string, direction: 1 | -1) => void;
  release: () => void;
  look: () => void;
}

/** Jogging the joints of a family: what it needs is looked up in the system. */
export function useJog(family: DeviceFamily): JogState {
  const control = useControl();
  const joints = "jog_speed" in family.type.parameters;
  const [missing, setMissing] = useState<"verb" | "heartbeat" | "unknown">("unknown");
  const [refusals, setRefusals] = useState<Refusal[]>([]);
  const [share, setShare] = useState(50);
  const [ready, setReady] = useState(false);
  const pressed = useRef<Press | null>(null);
  const last = useRef<Promise<unknown>>(Promise.resolve());

  const look = useCallback(() => {
    if (!joints || !control.may("operate")) return;
    control.look("names", {}).then(
      (names) => {
        const lacks = !names.verbs.includes(JOG) ? "verb" : !names.svvs.includes(BEAT) ? "heartbeat" : null;
        setReady(lacks === null);
        if (lacks) setMissing(lacks);
      },
      (why) => setRefusals(refusalsOf(why)),
    );
  }, [control, joints]);
  useEffect(look, [look]);

  const release = useCallback(() => {
    pressed.current?.release();
    pressed.current = null;
  }, []);
  // A button whose page is hidden or left is held no longer, nor is one whose connection is lost.
  useEffect(() => {
    const end = control.stream.connection.watch(release);
    window.addEventListener("blur", release);
    document.addEventListener("visibilitychange", release);
    return () => {
      release();
      end();
      window.removeEventListener("blur", release);
      document.removeEventListener("visibilitychange", release);
    };
  }, [control, release]);

  const press = (device: string, direction: 1 | -1) => {
    if (pressed.current) return;
    setRefusals([]);
    const begun = new Press(control, device, `${direction * share} %`, last.current);
    pressed.current = begun;
    last.current = begun.done;
    begun.done
      .catch((why) => setRefusals(refusalsOf(why)))
      .finally(() => {
        if (pressed.current === begun) pressed.current = null;
      });
  };
  return {
    able: ready,
    missing: joints && !ready && missing !== "unknown" ? missing : null,
    refusals,
    share,
    setShare,
    press,
    release,
    look,
  };
}

/** The two buttons of a joint: it moves while one is held, with the mouse, a finger, or the space bar. */
export function JogButtons(props: { of: JogState; device: string }) {
  const { of, device } = props;
  const held = (direction: 1 | -1) => ({
    onPointerDown: (event: React.PointerEvent<HTMLButtonElement>) => {
      // The main button alone: the right one opens a menu, and its release may never come.
      if (event.button !== 0 || !event.isPrimary) return;
      event.currentTarget.setPointerCapture(event.pointerId);
      of.press(device, direction);
    },
    onPointerUp: of.release,
    onPointerCancel: of.release,
    onLostPointerCapture: of.release,
    onContextMenu: of.release,
    onBlur: of.release,
    onKeyDown: (event: KeyboardEvent) => {
      if (event.key !== " " && event.key !== "Enter") return;
      event.preventDefault();
      if (!event.repeat) of.press(device, direction);
    },
    onKeyUp: of.release,
  });
  const name = shortName(device);
  return (
    <span className="jog" data-commands>
      <button type="button" aria-label={`Jog ${name} backward while held`} {...held(-1)}>
        −
      </button>
      <button type="button" aria-label={`Jog ${name} forward while held`} {...held(1)}>
        +
      </button>
    </span>
  );
}

/** Speed of jogging; or what is missing, and how to get it. */
export function JogTools(props: { of: JogState }) {
  const { of } = props;
  const control = useControl();
  const action = useAction();
  if (of.missing === "verb") {
    return (
      <p className="jog-tools quiet">
        Jogging needs the verb <code>jog</code> in this system: a program enters it with{" "}
        <code>motion.jog.new_instance(arm, cell.svv("{BEAT}", int))</code>.{" "}
        <button type="button" onClick={of.look}>
          Look again
        </button>
      </p>
    );
  }
  if (of.missing === "heartbeat") {
    return (
      <div className="jog-tools quiet">
        Jogging needs the SVV <code>{BEAT}</code>, into which this page writes while a button is held.{" "}
        {control.may("configure") ? (
          <button
            type="button"
            data-commands
            disabled={action.busy}
            onClick={() => action.run(() => control.order("svv", { name: BEAT, type_text: "int64_t" }).then(of.look))}
          >
            Make it
          </button>
        ) : (
          <>
            A program makes it: <code>cell.svv("{BEAT}", int)</code>.
          </>
        )}
        <Refusals of={action.refusals} />
      </div>
    );
  }
  if (!of.able) return null;
  return (
    <label className="jog-tools row">
      <span className="quiet">Jog speed</span>
      <input type="range" min={5} max={100} step={5} value={of.share} onChange={(event) => of.setShare(Number(event.target.value))} />
      <span className="figures">{of.share} %</span>
      <span className="quiet">of jog_speed; a joint moves while its button is held, and stops 0.25 s after the page is gone</span>
    </label>
  );
}
