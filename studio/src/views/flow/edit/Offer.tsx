// SPDX-License-Identifier: Apache-2.0

import { useEffect, useMemo, useState } from "react";
import { askUntilAnswered } from "../../../control/asking";
import { type Refusal, refusalsOf } from "../../../control/refusals";
import { Choices } from "../../../design/Choices";
import { Refusals } from "../../../design/parts";
import { tr } from "../../../language/text";
import { useLive } from "../../../shell/context";
import type { Draft, Graph } from "./definition";
import type { Faces } from "./faces";
import { fitting, offered, type PortAnswer, questionOf, tried, type WireOffer, type WireStart } from "./offered";

/** Choice of the possible ends of a wire, as determined by the system. */
export function Offer(props: {
  draft: Draft;
  faces: Faces;
  graphs: Graph[];
  from: WireStart;
  take: (offer: WireOffer) => void;
  close: () => void;
}) {
  const { draft, faces, graphs, from } = props;
  const control = useLive();
  const at = useMemo(() => tried(draft, faces, graphs), [draft, faces, graphs]);
  const [offers, setOffers] = useState<WireOffer[] | null>(null);
  const [refusals, setRefusals] = useState<Refusal[]>([]);
  useEffect(() => {
    const question = questionOf(draft, from, at);
    if (!question) {
      setOffers(offered(draft, from, at, fitting(draft, from, at, faces), faces));
      return;
    }
    return askUntilAnswered(control, {
      ask: (signal) => control.look("compatible", question as { from: { block: string; port: string } }, signal),
      take: (found) => {
        setOffers(offered(draft, from, at, found as PortAnswer[], faces));
        setRefusals([]);
      },
      failed: (why) => setRefusals(refusalsOf(why)),
    });
  }, [control, draft, faces, from, at]);
  return (
    <div
      className="offer"
      role="dialog"
      aria-label={tr("flow.whatBoxPortLeadsTo", {
        part: from.side === "output" ? tr("flow.theWireFrom") : tr("flow.theWireTo"),
        box: from.box,
        port: from.port,
      })}
      onBlur={(event) => {
        if (!event.currentTarget.contains(event.relatedTarget)) props.close();
      }}
    >
      <Refusals of={refusals} />
      {offers && (
        <Choices
          label={tr("flow.matchingBlockOrPort")}
          choices={offers}
          empty={tr("flow.noMatch2")}
          take={(choice) => {
            const offer = offers.find((one) => one.key === choice.key);
            if (offer) props.take(offer);
          }}
          close={props.close}
        />
      )}
      {!offers && refusals.length === 0 && <p className="quiet">{tr("flow.searchingForMatches")}</p>}
    </div>
  );
}
