// SPDX-License-Identifier: Apache-2.0
// The session's heartbeat. Runs in a worker, since the browser throttles timers of background pages, whose session would be lost.
let beat: ReturnType<typeof setInterval> | undefined;
/** Session that is currently kept alive. An answer that concerns an earlier session is ignored. */
let present: unknown = null;

self.onmessage = (message: MessageEvent<{ token: string | null; session: string; every_ms: number } | null>) => {
  clearInterval(beat);
  const said = message.data;
  present = said;
  if (!said) return;
  const headers: Record<string, string> = { "OpenGPAC-Session": said.session };
  if (said.token) headers.Authorization = `Bearer ${said.token}`;
  let isUnderWay = false;
  beat = setInterval(async () => {
    // A browser has six connections to a host: pending beats must not use them all up.
    if (isUnderWay) return;
    isUnderWay = true;
    try {
      const signal = AbortSignal.timeout(2 * said.every_ms);
      const answered = await fetch("/v1/heartbeat", { method: "POST", headers, cache: "no-store", signal });
      // Status 410: the session has ended. The page opens another one.
      if (answered.status === 410 && present === said) {
        clearInterval(beat);
        self.postMessage("lost");
      }
    } catch {
      // The system does not answer: the stream reports it, and the next beat tries again.
    } finally {
      isUnderWay = false;
    }
  }, said.every_ms);
};
