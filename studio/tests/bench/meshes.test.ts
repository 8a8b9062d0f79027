// SPDX-License-Identifier: Apache-2.0
// Frame rate of a moving arm whose bodies are dense meshes, at 1,440 pixels, printed next to the bar of the design. OPENGPAC_TRIANGLES sets
// the number of triangles.
import { join } from "node:path";
import { expect, test } from "vitest";
import { browse, goTo, open, run } from "../running";

const SECONDS = 10;
const TRIANGLES = process.env.OPENGPAC_TRIANGLES ?? "40000";

test("an arm of dense meshes that sways", { timeout: 300_000 }, async () => {
  const [running, browser] = await Promise.all([run(join(import.meta.dirname, "meshes.py")), browse(false)]);
  try {
    const { page, errors } = await open(browser, running.url);
    // Requesting pixels without drawing anything is not a frame.
    await page.evaluate(() => {
      const drawn = { calls: 0 };
      Object.assign(window, { drawn });
      for (const name of ["drawElements", "drawArrays"] as const) {
        const draws = WebGL2RenderingContext.prototype[name] as (...given: unknown[]) => void;
        const counted = function (this: WebGL2RenderingContext, ...given: unknown[]) {
          drawn.calls += 1;
          draws.apply(this, given);
        };
        Object.assign(WebGL2RenderingContext.prototype, { [name]: counted });
      }
    });
    await page.setViewportSize({ width: 1440, height: 900 });
    await goTo(page, "Devices");
    await page.locator('.stage[data-placed="yes"] canvas').waitFor();
    const frames = await page.evaluate(async (seconds) => {
      const canvas = document.querySelector<HTMLCanvasElement>(".stage canvas");
      if (!canvas) throw new Error("nothing is drawn");
      const context = (canvas.getContext("webgl2") ?? canvas.getContext("webgl")) as WebGL2RenderingContext;
      const { drawn } = window as unknown as { drawn: { calls: number } };
      const wheel = () => canvas.dispatchEvent(new WheelEvent("wheel", { deltaY: 1, bubbles: true, cancelable: true }));
      let [painted, before] = [0, drawn.calls];
      const begun = performance.now();
      while (performance.now() - begun < seconds * 1000) {
        // The view zooms in a little each time, so that there is something to draw.
        wheel();
        await new Promise((next) => requestAnimationFrame(next));
        // Returns when the pixels are available: the renderer has done all its work.
        context.readPixels(0, 0, 1, 1, context.RGBA, context.UNSIGNED_BYTE, new Uint8Array(4));
        if (drawn.calls > before) painted += 1;
        before = drawn.calls;
      }
      return painted / seconds;
    }, SECONDS);
    const renderer = await page.evaluate(() => {
      const context = document.createElement("canvas").getContext("webgl2");
      const about = context?.getExtension("WEBGL_debug_renderer_info");
      return about ? String(context?.getParameter(about.UNMASKED_RENDERER_WEBGL)) : "a renderer that does not say its name";
    });
    process.stdout.write(`an arm of ${TRIANGLES} triangles: ${frames.toFixed(1)} frames a second (30 at least), drawn by ${renderer}\n`);
    expect(errors).toEqual([]);
  } finally {
    await browser.close();
    await running.stop();
  }
});
