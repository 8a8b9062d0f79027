// SPDX-License-Identifier: Apache-2.0
import { tr } from "../language/text";
import { worded } from "./wording";

/** An error reported by the real-time system: its message, its subjects, the places where these were defined, and a remedy. */
export interface Refusal {
  class: string;
  message: string;
  remedy?: string;
  ends?: { what: string; place?: Place | null }[];
  place?: Place;
}

export interface Place {
  file: string;
  line: number;
}

/** Thrown if the system refuses a request. `refusals` are to be shown to the person, each with its remedy. */
export class RefusalError extends Error {
  readonly refusals: Refusal[];
  /** HTTP status; 0 if there was no answer. */
  readonly status: number;

  constructor(refusals: Refusal[], status: number) {
    super(refusals.map((refusal) => refusal.message).join("; "));
    this.name = "RefusalError";
    this.refusals = refusals;
    this.status = status;
  }

  is(name: string): boolean {
    return this.refusals.some((refusal) => refusal.class === name);
  }

  /**
   * True if a further attempt may be answered differently, after a lack of capacity, a request that took too long, or a fault of the server
   * or of a proxy.
   */
  get isTemporary(): boolean {
    return this.status === 408 || this.status === 429 || this.status >= 500;
  }

  /** True if the system failed at the request itself, so that the next attempt probably fails in the same way. */
  get isFault(): boolean {
    return this.status === 500;
  }
}

/** Converts any error to refusals, so that all errors are shown in the same way. */
export function refusalsOf(error: unknown): Refusal[] {
  if (error instanceof RefusalError) return error.refusals;
  if (error instanceof Error) return [{ class: error.name, message: error.message }];
  return [{ class: "Error", message: String(error) }];
}

/** Returns the error for a system that does not answer. */
export function unreachable(why: unknown): RefusalError {
  const message = tr("control.theRealTimeSystemDoesNot", { part: why instanceof Error ? why.message : String(why) });
  return new RefusalError([{ class: "ConnectionLost", message, remedy: tr("control.checkThatItIsStillRunning") }], 0);
}

/** Returns the error for a command given without a connection. The command is not sent, because it could then arrive at any later time. */
export function unconnected(): RefusalError {
  return new RefusalError(
    [
      {
        class: "ConnectionLost",
        message: tr("control.noConnectionToTheSystemThe"),
        remedy: tr("control.tryAgainWhenThePageShows"),
      },
    ],
    0,
  );
}

/** Returns the refusal with its message and remedy in the page's wording. */
export function inWords<R extends { message: string; remedy?: string | null }>(refusal: R): R {
  const { message, remedy } = refusal;
  return { ...refusal, message: worded(message), ...(remedy ? { remedy: worded(remedy) } : {}) };
}

/** Returns the error for an unsuccessful answer. */
export function refusedBy(status: number, body: string): RefusalError {
  try {
    const { errors } = JSON.parse(body) as { errors?: Refusal[] };
    if (errors && errors.length > 0) return new RefusalError(errors.map(inWords), status);
  } catch {
    // Not JSON: the answer is from something between the page and the system, and its text is shown.
  }
  const said = body.trim().slice(0, 200);
  return new RefusalError([{ class: "Error", message: tr("control.statusStatus", { status, part: said ? `: ${said}` : "" }) }], status);
}
