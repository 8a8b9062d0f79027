// SPDX-License-Identifier: Apache-2.0
// The session's sign of life. In a worker: a page in the background has its timers held back, and would be taken for lost.
let beat: ReturnType<typeof setInterval> | undefined;
/** Session that is kept alive now: an answer about an earlier one says nothing of it. */
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
    // A browser has six connections to a host: what waits for an answer does not take them all.
    if (isUnderWay) return;
    isUnderWay = true;
    try {
      const signal = AbortSignal.timeout(2 * said.every_ms);
      const answered = await fetch("/v1/heartbeat", { method: "POST", headers, cache: "no-store", signal });
      // 410: the session is over. The page opens another one.
      if (answered.status === 410 && present === said) {
        clearInterval(beat);
        self.postMessage("lost");
      }
    } catch {
      // The system does not answer: the stream shows it, and the next beat tries again.
    } finally {
      isUnderWay = false;
    }
  }, said.every_ms);
};
