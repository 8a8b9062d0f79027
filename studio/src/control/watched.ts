// SPDX-License-Identifier: Apache-2.0
/** A value with watchers, as required by `useSyncExternalStore`. */
export class WatchedValue<T> {
  #value: T;
  readonly #watchers = new Set<() => void>();

  constructor(value: T) {
    this.#value = value;
  }

  readonly get = (): T => this.#value;

  set(value: T): void {
    if (Object.is(value, this.#value)) return;
    this.#value = value;
    for (const watcher of [...this.#watchers]) watcher();
  }

  readonly watch = (watcher: () => void): (() => void) => {
    this.#watchers.add(watcher);
    return () => this.#watchers.delete(watcher);
  };

  get watched(): boolean {
    return this.#watchers.size > 0;
  }
}
