// SPDX-License-Identifier: Apache-2.0
import type { Statistics } from "./shapes";

/** The verb instances that this page has started, and those among them that it has made. */
export class StartedInstances {
  readonly #instances = new Set<number>();
  readonly #made = new Set<number>();

  add(instance: number): void {
    this.#instances.add(instance);
  }

  make(instance: number): void {
    this.#made.add(instance);
  }

  /** Forgets all of them: they are of another run of the system. */
  forget(): void {
    this.#instances.clear();
    this.#made.clear();
  }

  /** Returns whether this page made the instance: it may delete it. An instance of the program, or of another page, is left alone. */
  made(instance: number): boolean {
    return this.#made.has(instance);
  }

  /** Returns whether one of them runs or is suspended. */
  running(now: Statistics | null): boolean {
    return now?.instances.some((one) => this.#instances.has(one.id) && (one.state === "running" || one.state === "suspended")) ?? false;
  }
}
