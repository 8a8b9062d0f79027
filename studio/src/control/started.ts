// SPDX-License-Identifier: Apache-2.0
import type { Statistics } from "./shapes";

/** The verb instances that this page has started, and those that it has created. */
export class StartedInstances {
  readonly #instances = new Set<number>();
  readonly #made = new Set<number>();

  add(instance: number): void {
    this.#instances.add(instance);
  }

  make(instance: number): void {
    this.#made.add(instance);
  }

  /** Forgets all instances, because another run of the system answers. */
  forget(): void {
    this.#instances.clear();
    this.#made.clear();
  }

  /** Returns whether this page created the instance, and so may delete it. Instances of a program or of another page are not deleted. */
  made(instance: number): boolean {
    return this.#made.has(instance);
  }

  /** Returns whether one of the started instances is running or suspended. */
  running(now: Statistics | null): boolean {
    return now?.instances.some((one) => this.#instances.has(one.id) && (one.state === "running" || one.state === "suspended")) ?? false;
  }
}
