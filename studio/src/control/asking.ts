// SPDX-License-Identifier: Apache-2.0
import { type Refusal, RefusalError } from "./refusals";
import type { Source } from "./source";
import { WatchedValue } from "./watched";

/** Wait before a question that was not answered is asked again, ms. */
export const AGAIN_MS = 1000;
/** Longest wait before a question at which the system failed is asked again, ms. */
export const FAULTY_MAX_MS = 60_000;

/** A question to the system, and the receivers of its answer. */
export interface Question<T> {
  ask: (signal: AbortSignal) => Promise<T>;
  take: (answer: T) => void;
  /** Receives the reason of each failed attempt. Without it, the page reports a fault of the system among its messages. */
  failed?: (why: unknown) => void;
  /** Wait before the first attempt, ms. */
  after_ms?: number;
}

/** Faults of the system at open questions that do not show their failures themselves. */
export const faults = new WatchedValue<readonly Refusal[]>([]);

/**
 * Asks a question until the system answers it. A refusal is an answer; a lost connection, a lack of capacity, a request that took too
 * long and a fault of the system are not, so the question is asked again. A restarted system is asked again too, because its answer may
 * differ. Returns a function that withdraws the question: its receivers are not called afterwards.
 */
export function askUntilAnswered<T>(of: Pick<Source, "restarts">, question: Question<T>): () => void {
  let over = new AbortController();
  let again: ReturnType<typeof setTimeout> | undefined;
  let attempts = new Attempts();
  const reported = new ReportedFault();
  const attempt = () => {
    const { signal } = over;
    void question.ask(signal).then(
      (answer) => {
        if (signal.aborted) return;
        reported.put(null);
        question.take(answer);
      },
      (why) => {
        if (signal.aborted) return;
        reported.put(question.failed ? null : why);
        question.failed?.(why);
        const wait_ms = attempts.againAfter_ms(why);
        if (wait_ms !== null) again = setTimeout(attempt, wait_ms);
      },
    );
  };
  const withdraw = () => {
    clearTimeout(again);
    over.abort();
    reported.put(null);
  };
  const forget = of.restarts.watch(() => {
    withdraw();
    over = new AbortController();
    attempts = new Attempts();
    attempt();
  });
  if (question.after_ms === undefined) attempt();
  else again = setTimeout(attempt, question.after_ms);
  return () => {
    forget();
    withdraw();
  };
}

/** Attempts to get one question answered. Waits longer after each fault of the system, because the question itself may cause it. */
export class Attempts {
  #faults = 0;
  #failures = 0;

  get hasFailed(): boolean {
    return this.#failures > 0;
  }

  /** Returns the time after which the question is to be asked again, ms; `null` if the error is an answer. */
  againAfter_ms(why: unknown): number | null {
    this.#failures += 1;
    if (!isUnanswered(why)) return null;
    if (!isFault(why)) return AGAIN_MS;
    this.#faults += 1;
    return Math.min(FAULTY_MAX_MS, AGAIN_MS * 2 ** (this.#faults - 1));
  }
}

/** Returns true if an error says nothing about the question, so that another attempt may be answered. */
export function isUnanswered(why: unknown): boolean {
  return why instanceof RefusalError && (why.is("ConnectionLost") || why.isTemporary);
}

/** Returns true if the system failed at the question. */
function isFault(why: unknown): why is RefusalError {
  return why instanceof RefusalError && why.isFault;
}

/** The fault of one question among `faults`. */
class ReportedFault {
  #now: readonly Refusal[] = [];

  put(why: unknown): void {
    const next = isFault(why) ? why.refusals : [];
    if (next.length === 0 && this.#now.length === 0) return;
    const others = faults.get().filter((one) => !this.#now.includes(one));
    this.#now = next;
    faults.set([...others, ...next]);
  }
}
