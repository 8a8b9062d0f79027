// SPDX-License-Identifier: Apache-2.0
// A daemon with a token, for the page, with all its files in one folder.
import { type ChildProcess, execFileSync, spawn } from "node:child_process";
import { createServer } from "node:net";
import { join } from "node:path";
import { BUILT, PYTHON, SURROUNDINGS } from "./running";

/** Returns an unused port. */
export function freePort(): Promise<number> {
  return new Promise((found) => {
    const server = createServer();
    server.listen(0, "127.0.0.1", () => {
      const address = server.address();
      server.close(() => found(typeof address === "object" && address ? address.port : 0));
    });
  });
}

/** Creates a token of role `configure` in the folder. */
export function tokenIn(folder: string, name = "page"): string {
  const made = ["token", "new", "--tokens", join(folder, "tokens.json"), "--role", "configure", "--name", name];
  return /gpac_\S+/.exec(execFileSync(PYTHON, ["-m", "opengpac", ...made], { env: SURROUNDINGS }).toString())?.[0] ?? "";
}

/** Starts a daemon with the tokens and recordings of the folder, for a system that blinks; resolves when it listens. */
export function serve(folder: string, port: number, ...options: string[]): Promise<ChildProcess> {
  return serveProgram([join(import.meta.dirname, "restarted.py")], folder, port, ...options);
}

/** Does the same for the system that a program, run with these arguments, leaves open. */
export function serveProgram(program: string[], folder: string, port: number, ...options: string[]): Promise<ChildProcess> {
  const address = ["--listen", `127.0.0.1:${port}`, "--tokens", join(folder, "tokens.json"), "--socket", join(folder, "cell.sock")];
  const command = ["-m", "opengpac", "rts", ...address, "--page", BUILT, "--records", folder, ...options, ...program];
  const process_ = spawn(PYTHON, command, { env: SURROUNDINGS });
  let text = "";
  return new Promise((listens, failed) => {
    const hear = (chunk: Buffer) => {
      text += chunk.toString();
      if (text.includes(`127.0.0.1:${port}`)) listens(process_);
    };
    process_.stdout.on("data", hear);
    process_.stderr.on("data", hear);
    process_.once("exit", (code) => failed(new Error(`opengpac rts ended with ${code}:\n${text}`)));
  });
}
