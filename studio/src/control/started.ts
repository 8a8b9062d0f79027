// SPDX-License-Identifier: Apache-2.0
import type { Statistics } from "./shapes";

/** The verb instances that this page has started. */
export class Started {
  readonly #instances = new Set<number>();

  add(instance: number): void {
    this.#instances.add(instance);
  }

  /** Of another run of the system nothing was started by this page. */
  forget(): void {
    this.#instances.clear();
  }

  has(instance: number): boolean {
    return this.#instances.has(instance);
  }

  /** Whether one of them runs or is suspended. */
  running(now: Statistics | null): boolean {
    return now?.instances.some((one) => this.#instances.has(one.id) && (one.state === "running" || one.state === "suspended")) ?? false;
  }
}
