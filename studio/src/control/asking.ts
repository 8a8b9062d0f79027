// SPDX-License-Identifier: Apache-2.0
import { RefusalError } from "./refusals";
import type { Source } from "./source";

/** Wait before a question that was not answered is asked again, ms. */
export const AGAIN_MS = 1000;

/** A question to the system, and the receivers of its answer. */
export interface Question<T> {
  ask: (signal: AbortSignal) => Promise<T>;
  take: (answer: T) => void;
  /** Receives the reason of each failed attempt. */
  failed?: (why: unknown) => void;
  /** Wait before the first attempt, ms. */
  after_ms?: number;
}

/**
 * Asks a question until the system answers it. A refusal is an answer; a lost connection, a lack of capacity and a request that took too
 * long are not, so the question is asked again. A restarted system is asked again too, because its answer may differ. Returns a function
 * that withdraws the question: its receivers are not called afterwards.
 */
export function askUntilAnswered<T>(of: Pick<Source, "restarts">, question: Question<T>): () => void {
  let over = new AbortController();
  let again: ReturnType<typeof setTimeout> | undefined;
  const attempt = () => {
    const { signal } = over;
    void question.ask(signal).then(
      (answer) => {
        if (!signal.aborted) question.take(answer);
      },
      (why) => {
        if (signal.aborted) return;
        question.failed?.(why);
        if (isUnanswered(why)) again = setTimeout(attempt, AGAIN_MS);
      },
    );
  };
  const withdraw = () => {
    clearTimeout(again);
    over.abort();
  };
  const forget = of.restarts.watch(() => {
    withdraw();
    over = new AbortController();
    attempt();
  });
  if (question.after_ms === undefined) attempt();
  else again = setTimeout(attempt, question.after_ms);
  return () => {
    forget();
    withdraw();
  };
}

/** Returns true if an error says nothing about the question, so that another attempt may be answered. */
function isUnanswered(why: unknown): boolean {
  return why instanceof RefusalError && (why.is("ConnectionLost") || why.isTemporary);
}
