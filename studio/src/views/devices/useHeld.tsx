// SPDX-License-Identifier: Apache-2.0
import { type KeyboardEvent, type ReactNode, useCallback, useEffect, useRef, useState } from "react";
import { type Refusal, refusalsOf } from "../../control/refusals";
import type { Report } from "../../control/shapes";
import type { Source } from "../../control/source";
import { useControl } from "../../shell/context";
import { type JogMotion, Press } from "./jogging";

/** Latest press of each system. The next press, even of another button, waits until its motion has halted. */
const LAST = new WeakMap<Source, Promise<unknown>>();

export interface HeldMotion {
  /** Motion in progress; null if there is none. */
  under: JogMotion | null;
  refusals: Refusal[];
  /** Starts a motion, unless another one is in progress that is a step or whose button is still held. */
  press: (motion: JogMotion) => void;
  /** Releases the button. */
  release: () => void;
}

/**
 * Returns functions that move a machine while a button is held, or by a step. `told` receives the report of a motion that ended by
 * itself.
 */
export function useHeld(told: (report: Report) => void = () => undefined): HeldMotion {
  const control = useControl();
  const [refusals, setRefusals] = useState<Refusal[]>([]);
  const [under, setUnder] = useState<JogMotion | null>(null);
  const pressed = useRef<Press | null>(null);

  const leave = useCallback(() => {
    pressed.current?.leave();
    pressed.current = null;
  }, []);
  const release = useCallback(() => {
    pressed.current?.release();
    if (!pressed.current?.motion.isStep) pressed.current = null;
  }, []);
  // A button is no longer held if its page is hidden or left, or its connection is lost.
  useEffect(() => {
    const end = control.stream.connection.watch(leave);
    window.addEventListener("blur", leave);
    document.addEventListener("visibilitychange", leave);
    return () => {
      leave();
      end();
      window.removeEventListener("blur", leave);
      document.removeEventListener("visibilitychange", leave);
    };
  }, [control, leave]);

  const press = (motion: JogMotion) => {
    if (pressed.current) return;
    setRefusals([]);
    setUnder(motion);
    const begun = new Press(control, motion, LAST.get(control));
    pressed.current = begun;
    LAST.set(control, begun.done);
    begun.done
      .then(
        (report) => report && told(report),
        (why) => setRefusals(refusalsOf(why)),
      )
      .finally(() => {
        if (pressed.current === begun) pressed.current = null;
        setUnder((now) => (now === motion ? null : now));
      });
  };
  return { under, refusals, press, release };
}

/** A button that moves a machine while it is held with the mouse, a finger, or the space bar. */
export function HeldButton(props: { label: string; press: () => void; release: () => void; isBusy?: boolean; children: ReactNode }) {
  // The previously pressed button loses the focus only after this one was pressed, which must not release this one.
  const isPressed = useRef(false);
  const press = () => {
    isPressed.current = true;
    props.press();
  };
  const release = () => {
    if (isPressed.current) props.release();
    isPressed.current = false;
  };
  return (
    <button
      type="button"
      aria-label={props.label}
      aria-disabled={props.isBusy}
      onPointerDown={(event) => {
        // Main button only: the secondary one opens a menu, and its release may never arrive.
        if (event.button !== 0 || !event.isPrimary) return;
        event.currentTarget.setPointerCapture(event.pointerId);
        press();
      }}
      onPointerUp={release}
      onPointerCancel={release}
      onLostPointerCapture={release}
      onContextMenu={release}
      onBlur={release}
      onKeyDown={(event: KeyboardEvent) => {
        if (event.key !== " " && event.key !== "Enter") return;
        event.preventDefault();
        if (!event.repeat) press();
      }}
      onKeyUp={release}
    >
      {props.children}
    </button>
  );
}
