// SPDX-License-Identifier: Apache-2.0
import type { Statistics } from "./shapes";

const KEY = "opengpac.started";

/**
 * The verb instances that this page has started, and those that it has created. The started ones are kept in a storage, if there is one,
 * because a reloaded page continues its session. The created ones are not: a copied tab has a copy of the storage, but may not delete the
 * instances of the first one.
 */
export class StartedInstances {
  readonly #instances: Set<number>;
  readonly #made = new Set<number>();
  readonly #storage: Pick<Storage, "getItem" | "setItem"> | null;
  #run: string;

  /** `run` identifies the run of the system: numbers of instances of another run have no meaning. */
  constructor(run = "", storage: Pick<Storage, "getItem" | "setItem"> | null = null) {
    this.#run = run;
    this.#storage = storage;
    this.#instances = new Set(startedOf(storage?.getItem(KEY) ?? null, run));
  }

  add(instance: number): void {
    this.#instances.add(instance);
    this.#keep();
  }

  make(instance: number): void {
    this.#made.add(instance);
  }

  /** Discards all instances, because the system has restarted. */
  forget(run: string): void {
    this.#run = run;
    this.#instances.clear();
    this.#made.clear();
    this.#keep();
  }

  /** Returns whether this page created the instance, and so may delete it. Instances of a program or of another page are not deleted. */
  made(instance: number): boolean {
    return this.#made.has(instance);
  }

  /** Returns whether one of the started instances is running or suspended. */
  running(now: Statistics | null): boolean {
    return now?.instances.some((one) => this.#instances.has(one.id) && (one.state === "running" || one.state === "suspended")) ?? false;
  }

  #keep(): void {
    this.#storage?.setItem(KEY, JSON.stringify({ run: this.#run, started: [...this.#instances] }));
  }
}

function startedOf(text: string | null, run: string): number[] {
  try {
    const kept = JSON.parse(text ?? "null") as { run: string; started: number[] } | null;
    return kept?.run === run ? kept.started : [];
  } catch {
    return [];
  }
}
