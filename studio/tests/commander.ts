// SPDX-License-Identifier: Apache-2.0
/** A client that commands the system in addition to the page: a session of the control interface. */
export class Commander {
  readonly #base: string;
  readonly #token: string;
  #session = "";
  #alive: ReturnType<typeof setInterval> | undefined;

  private constructor(base: string, token: string) {
    this.#base = base;
    this.#token = token;
  }

  /** Opens a session that commands. `url` is the page's address, with its token. */
  static async open(url: string, force = false): Promise<Commander> {
    const { origin, hash } = new URL(url);
    const made = new Commander(origin, decodeURIComponent(hash.replace("#token=", "")));
    const { session } = await made.#ask<{ session: string }>("POST", "/v1/sessions", { name: "commander", lost_after_ms: 60_000 });
    made.#session = session;
    await made.take(force);
    // If a heartbeat is lost, the next call reports the lost session.
    made.#alive = setInterval(() => made.#ask("POST", "/v1/heartbeat").catch(() => {}), 2000);
    return made;
  }

  /** Opens a session that only observes, without command. */
  static async look(url: string): Promise<Commander> {
    const { origin, hash } = new URL(url);
    const made = new Commander(origin, decodeURIComponent(hash.replace("#token=", "")));
    const { session } = await made.#ask<{ session: string }>("POST", "/v1/sessions", { name: "looker", lost_after_ms: 60_000 });
    made.#session = session;
    made.#alive = setInterval(() => made.#ask("POST", "/v1/heartbeat").catch(() => {}), 2000);
    return made;
  }

  sessions(): Promise<{ name: string; alive: boolean }[]> {
    return this.#ask("GET", "/v1/sessions");
  }

  /** Returns all verb instances. */
  async instances(): Promise<{ id: number; name: string; verb: string; state: string }[]> {
    return (await this.call<{ instances: { id: number; name: string; verb: string; state: string }[] }>("statistics", {})).instances;
  }

  /** Returns the number of starts so far. */
  async starts(): Promise<number> {
    const log = await this.call<{ kind: string }[]>("log", { since: 0 });
    return log.filter((entry) => entry.kind === "start").length;
  }

  /** Returns the start times of instances whose name begins with this, ms of the system's clock. */
  async startsOf(name: string): Promise<number[]> {
    const log = await this.call<{ kind: string; about: string; time_s: number }[]>("log", { since: 0 });
    return log.filter((entry) => entry.kind === "start" && entry.about.startsWith(name)).map((entry) => entry.time_s * 1000);
  }

  /** Returns the time of the system's clock, ms. */
  async now_ms(): Promise<number> {
    return (await this.call<number>("now", {})) / 1e6;
  }

  async take(force = true): Promise<void> {
    await this.#ask("POST", "/v1/command", force ? { force } : {});
  }

  async giveBack(): Promise<void> {
    await this.#ask("DELETE", "/v1/command");
  }

  async start(verb: string): Promise<void> {
    await this.call("start", { instance: await this.#instance(verb) });
  }

  async halt(verb: string): Promise<void> {
    await this.call("halt", { instance: await this.#instance(verb) });
  }

  /** Returns the present value of a numeric SVV. */
  async value(name: string): Promise<number> {
    const { values } = await this.call<{ values: Record<string, { value: number }> }>("read", { names: [name] });
    return values[name]?.value ?? Number.NaN;
  }

  call<T>(name: string, args: object): Promise<T> {
    return this.#ask<T>("POST", `/v1/call/${name}`, args);
  }

  /** Returns the name of the session that commands, or `null`. */
  async holder(): Promise<string | null> {
    return (await this.#ask<{ holder: string } | null>("GET", "/v1/command"))?.holder ?? null;
  }

  async close(): Promise<void> {
    clearInterval(this.#alive);
    await this.#ask("DELETE", "/v1/sessions");
  }

  async #instance(verb: string): Promise<number> {
    const { instances } = await this.call<{ instances: { id: number; verb: string }[] }>("statistics", {});
    const found = instances.find((one) => one.verb === verb);
    if (!found) throw new Error(`there is no instance of '${verb}'`);
    return found.id;
  }

  async #ask<T>(method: string, path: string, body?: object): Promise<T> {
    const headers: Record<string, string> = { Authorization: `Bearer ${this.#token}` };
    if (this.#session) headers["OpenGPAC-Session"] = this.#session;
    const answered = await fetch(`${this.#base}${path}`, { method, headers, ...(body && { body: JSON.stringify(body) }) });
    const said = (await answered.json()) as { result: T; errors?: { message: string }[] };
    if (!answered.ok) throw new Error(`${method} ${path}: ${said.errors?.map((one) => one.message).join("; ") ?? answered.status}`);
    return said.result;
  }
}
