// SPDX-License-Identifier: Apache-2.0

import { Choice } from "../../design/Choice";
import { count } from "../../design/numbers";
import { tr } from "../../language/text";
import { useWatched } from "../../shell/context";
import type { ChannelCounts } from "./messages";
import type { Scope } from "./scope";

const KEEPS_S = [10, 30, 60, 120, 300, 600];

/** Numbers of received, lost and stored values. */
export function Counts(props: { scope: Scope }) {
  const { scope } = props;
  const counts = useWatched(scope.counts);
  const setup = useWatched(scope.setup);
  const trouble = useWatched(scope.trouble);
  const sum = (of: (one: ChannelCounts) => number) => counts.reduce((all, one) => all + of(one), 0);
  const lost = sum((one) => one.lost);
  const skipped = sum((one) => one.skipped);
  const unseen = sum((one) => Math.max(0, one.numbered - one.received - one.lost));
  const most_s = counts.reduce((most, one) => Math.max(most, one.kept_s), 0);
  return (
    <div
      className="counts small"
      title={counts
        .map((one) => tr("scope.nameReceivedReceivedLostLost", { name: one.name, received: one.received, lost: one.lost }))
        .join("\n")}
    >
      <span>
        {tr("scope.received")}{" "}
        <span className="figures" data-testid="received">
          {count(sum((one) => one.received))}
        </span>
        ,{" "}
        <span className={lost > 0 ? "bad" : ""}>
          {tr("scope.lost")}{" "}
          <span className="figures" data-testid="lost">
            {count(lost)}
          </span>
        </span>
        {skipped > 0 && (
          <>
            {tr("scope.discardedWhileStopped")} <span className="figures">{count(skipped)}</span>
          </>
        )}
        {unseen > 0 && (
          <>
            ,{" "}
            <span className="quiet" title={tr("scope.theSequenceNumbersJumpHereA")}>
              {tr("scope.neverStoredOverruns")} <span className="figures">{count(unseen)}</span>
            </span>
          </>
        )}
      </span>
      <span className="quiet">
        {counts.length} {tr("scope.channels", { count: counts.length })}
        {tr("scope.theLastMostSSIn", { most_s: most_s.toFixed(1), value: (sum((one) => one.bytes) / 2 ** 20).toFixed(1) })}
      </span>
      <Choice label={tr("scope.keep")} value={String(setup.keep_s)} put={(chosen) => scope.change({ ...setup, keep_s: Number(chosen) })}>
        {[...new Set([...KEEPS_S, setup.keep_s])]
          .sort((a, b) => a - b)
          .map((keep) => (
            <option key={keep} value={keep}>
              {keep} s
            </option>
          ))}
      </Choice>
      {trouble && <span className="bad">{trouble}</span>}
    </div>
  );
}
