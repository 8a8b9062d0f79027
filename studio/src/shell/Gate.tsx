// SPDX-License-Identifier: Apache-2.0

import { useCallback, useEffect, useMemo, useState } from "react";
import { type Control, connect } from "../control/control";
import { RefusalError, refusalsOf } from "../control/refusals";
import { forgetToken, keepToken } from "../control/token";
import { Refusals } from "../design/parts";
import { trNodes } from "../language/nodes";
import { tr } from "../language/text";
import { Axis, AxisContext } from "./axis";
import { ControlContext, SourceContext } from "./context";
import { Shell } from "./Shell";

/** Interval between connection attempts if the system does not answer, ms. */
const AGAIN_MS = 2000;

/** Connects to the system before the studio is shown. If there is no valid token, explains where to get one. */
export function Gate(props: { token: string | null }) {
  const [token, setToken] = useState(props.token);
  const [control, setControl] = useState<Control | null>(null);
  const [failure, setFailure] = useState<unknown>(null);

  useEffect(() => {
    let over = false;
    let again: ReturnType<typeof setTimeout> | undefined;
    let made: Control | null = null;
    const attempt = async () => {
      try {
        const found = await connect(token);
        if (over) return;
        made = found;
        found.open();
        setFailure(null);
        setControl(found);
      } catch (why) {
        if (over) return;
        setFailure(why);
        if (!(why instanceof RefusalError && why.status === 401)) again = setTimeout(attempt, AGAIN_MS);
      }
    };
    void attempt();
    return () => {
      over = true;
      clearTimeout(again);
      made?.close();
    };
  }, [token]);

  const renew = useCallback((given: string | null) => {
    setControl(null);
    setToken(given);
  }, []);

  const axis = useMemo(() => control && new Axis(control), [control]);
  if (control) {
    return (
      <ControlContext value={control}>
        <AxisContext value={axis}>
          <SourceContext value={control}>
            <Shell />
          </SourceContext>
        </AxisContext>
      </ControlContext>
    );
  }
  return <Door failure={failure} open={renew} />;
}

function Door(props: { failure: unknown; open: (token: string) => void }) {
  if (!props.failure) return <main className="door quiet">{tr("shell.connecting")}</main>;
  const unknown = props.failure instanceof RefusalError && props.failure.status === 401;
  return (
    <main className="door stack">
      <h1>{tr("shell.openGPACStudio")}</h1>
      <Refusals of={refusalsOf(props.failure)} />
      {unknown && (
        <form
          className="stack"
          onSubmit={(event) => {
            event.preventDefault();
            const given = String(new FormData(event.currentTarget).get("token") ?? "").trim();
            const token = given.includes("token=") ? decodeURIComponent(given.split("token=").at(-1) ?? "") : given;
            forgetToken();
            keepToken(token);
            props.open(token);
          }}
        >
          <p>
            {trNodes("shell.openTheAddressThatCodeCode2", {
              code: <code>opengpac studio</code>,
              code2: <code>opengpac rts</code>,
              code3: <code>cell.studio()</code>,
            })}
          </p>
          <div className="row">
            <label htmlFor="token">{tr("shell.token")}</label>
            <input id="token" name="token" type="password" autoComplete="off" required size={40} />
            <button type="submit" className="primary">
              {tr("shell.open")}
            </button>
          </div>
        </form>
      )}
    </main>
  );
}
