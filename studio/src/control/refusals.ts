// SPDX-License-Identifier: Apache-2.0
import { worded } from "./wording";

/** One error of the real-time system: what is wrong, about what, where it was defined, and what to do. */
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

/** The system refused. Its words are for the person: show `refusals`, each with its remedy. */
export class RefusalError extends Error {
  readonly refusals: Refusal[];
  /** HTTP status; 0 where no answer came. */
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
}

/** Any error as refusals, so that each can be shown in the same way. */
export function refusalsOf(error: unknown): Refusal[] {
  if (error instanceof RefusalError) return error.refusals;
  if (error instanceof Error) return [{ class: error.name, message: error.message }];
  return [{ class: "Error", message: String(error) }];
}

/** The system did not answer at all. */
export function unreachable(why: unknown): RefusalError {
  const message = `the real-time system does not answer (${why instanceof Error ? why.message : String(why)})`;
  return new RefusalError(
    [{ class: "ConnectionLost", message, remedy: "is it still running? the page goes on by itself when it is there again" }],
    0,
  );
}

/** There is no connection: a command is not even sent, for it could arrive at any time. */
export function unconnected(): RefusalError {
  return new RefusalError(
    [
      {
        class: "ConnectionLost",
        message: "there is no connection to the system: nothing was commanded",
        remedy: "try again when the page says 'live'",
      },
    ],
    0,
  );
}

/** A refusal whose message and remedy are in the page's words. */
export function inWords<R extends { message: string; remedy?: string | null }>(refusal: R): R {
  const { message, remedy } = refusal;
  return { ...refusal, message: worded(message), ...(remedy ? { remedy: worded(remedy) } : {}) };
}

/** Returns the refusal in an answer that is no success. */
export function refusedBy(status: number, body: string): RefusalError {
  try {
    const { errors } = JSON.parse(body) as { errors?: Refusal[] };
    if (errors && errors.length > 0) return new RefusalError(errors.map(inWords), status);
  } catch {
    // Not JSON: whatever stands between the page and the system has answered. Its words are told below.
  }
  const said = body.trim().slice(0, 200);
  return new RefusalError([{ class: "Error", message: `status ${status}${said ? `: ${said}` : ""}` }], status);
}
