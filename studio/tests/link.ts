// SPDX-License-Identifier: Apache-2.0
// The network between a page and its system, controlled by a test: it freezes, delays, drops and cuts.
import { connect, createServer, type Server, type Socket } from "node:net";

export class Link {
  readonly port: number;
  readonly #server: Server;
  readonly #pairs = new Set<[Socket, Socket]>();
  #isFrozen = false;
  #delay_ms = 0;
  #isCut = false;
  #drops = false;
  #held: (() => void)[] | null = null;

  private constructor(server: Server, port: number) {
    this.#server = server;
    this.port = port;
  }

  /** Creates a link to a port of this machine. */
  static to(target: number): Promise<Link> {
    return new Promise((made) => {
      let link: Link | null = null;
      const server = createServer((near) => {
        if (link) link.#take(near, target);
      });
      server.listen(0, "127.0.0.1", () => {
        const address = server.address();
        link = new Link(server, typeof address === "object" && address ? address.port : 0);
        made(link);
      });
    });
  }

  /** Stops all data in both directions, without notice. New connections are accepted and are just as silent. */
  freeze(): void {
    this.#isFrozen = true;
    for (const pair of this.#pairs) for (const socket of pair) socket.pause();
  }

  /** Delivers everything that was held up. */
  thaw(): void {
    this.#isFrozen = false;
    for (const pair of this.#pairs) for (const socket of pair) socket.resume();
  }

  /** Delays everything by `ms`. */
  delay(ms: number): void {
    this.#delay_ms = ms;
  }

  /** Drops all data while set; connections stay. */
  drop(drops: boolean): void {
    this.#drops = drops;
  }

  /** Holds every request of the page except a stop of everything and a heartbeat; `false` delivers the held ones. */
  hold(holds: boolean): void {
    const held = this.#held ?? [];
    this.#held = holds ? [] : null;
    for (const send of held) send();
  }

  /** Number of held requests. */
  get held(): number {
    return this.#held?.length ?? 0;
  }

  /** Ends all connections, and refuses new ones. */
  cut(): void {
    this.#isCut = true;
    for (const pair of this.#pairs) for (const socket of pair) socket.destroy();
  }

  mend(): void {
    this.#isCut = false;
  }

  close(): void {
    this.cut();
    this.#server.close();
  }

  #take(near: Socket, target: number): void {
    if (this.#isCut) {
      near.destroy();
      return;
    }
    const far = connect(target, "127.0.0.1");
    const pair: [Socket, Socket] = [near, far];
    this.#pairs.add(pair);
    for (const [from, to] of [pair, [far, near]] as const) {
      from.setNoDelay(true);
      from.on("data", (bytes) => this.#carry(bytes, to));
      from.on("error", () => to.destroy());
      from.on("close", () => {
        this.#pairs.delete(pair);
        to.destroy();
      });
      if (this.#isFrozen) from.pause();
    }
  }

  #carry(bytes: Buffer, to: Socket): void {
    if (this.#drops) return;
    const send = () => {
      if (!to.destroyed) to.write(bytes);
    };
    if (this.#held && isHeld(bytes)) this.#held.push(send);
    else if (this.#delay_ms > 0) setTimeout(send, this.#delay_ms);
    else send();
  }
}

/** Returns true for any request other than a stop of everything or a heartbeat. */
function isHeld(bytes: Buffer): boolean {
  const line = bytes.subarray(0, 60).toString("latin1");
  return /^(GET|POST) \/v1\//.test(line) && !/emergency_stop|heartbeat/.test(line);
}
