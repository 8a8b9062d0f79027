// SPDX-License-Identifier: Apache-2.0
import { useMemo, useRef, useState } from "react";
import { Tag } from "../../design/parts";
import { tr } from "../../language/text";
import { useLive, useTopic, useWatched } from "../context";
import { useRoute } from "../route";
import { type Observation, stepsOf } from "./steps";
import { type ArmTour, tour } from "./tour";

/**
 * The tour, if one is in progress, shown below the bars. It does not command anything itself: each step names a control of the page, and
 * detects that a person has used it.
 */
export function Tour() {
  const begun = useWatched(tour);
  return begun && <Steps of={begun} />;
}

function Steps(props: { of: ArmTour }) {
  const { joints } = props.of;
  const steps = useMemo(() => stepsOf(joints), [joints]);
  const [at, setAt] = useState(0);
  const step = steps[at];
  const isDone = useDone(step?.isDone ?? (() => false), at);
  if (!step) return null;
  const isLast = at === steps.length - 1;
  return (
    <section className="tour" aria-label={tr("tour.tour")}>
      <div className="tour-text">
        <p>
          <span className="quiet figures">{tr("tour.stepAtOfCount", { at: at + 1, count: steps.length })}</span>{" "}
          <strong>{step.title}</strong> <span role="status">{isDone && <Tag tone="accent">{tr("tour.done")}</Tag>}</span>
        </p>
        <p>{step.about}</p>
      </div>
      <div className="row">
        {step.link && <a href={step.link.address}>{step.link.text}</a>}
        <button type="button" className={isDone ? "primary" : ""} onClick={() => (isLast ? tour.set(null) : setAt(at + 1))}>
          {isLast ? tr("tour.finish") : tr("tour.next")}
        </button>
        <button type="button" onClick={() => tour.set(null)}>
          {tr("tour.leave")}
        </button>
      </div>
    </section>
  );
}

/** Returns whether a step has been completed since it began. Once completed, it remains so. */
function useDone(isDone: (seen: Observation) => boolean, step: number): boolean {
  const { topics } = useLive();
  const now = useTopic(topics.statistics);
  const ends = useTopic(topics.ends);
  const { view } = useRoute();
  const seen = useRef({ step: -1, first: 0, wasStopped: false, isDone: false });
  const all = ends?.entries ?? [];
  // Ends from before the step are no part of it. Those from before the tour have arrived by the second step, the first that looks at ends.
  if (seen.current.step !== step) {
    seen.current = { step, first: (all.at(-1)?.number ?? -1) + 1, wasStopped: false, isDone: false };
  }
  const { current } = seen;
  if (now?.emergency) current.wasStopped = true;
  const reports = all.filter((end) => end.number >= current.first).map((end) => end.report);
  if (now && isDone({ now, reports, view, wasStopped: current.wasStopped })) current.isDone = true;
  return current.isDone;
}
