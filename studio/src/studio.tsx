// SPDX-License-Identifier: Apache-2.0
import { StrictMode } from "react";
import { createRoot } from "react-dom/client";
import { Gate } from "./shell/Gate";

/** Shows the studio in an element of the document. */
export function showStudio(place: HTMLElement, token: string | null): void {
  createRoot(place).render(
    <StrictMode>
      <Gate token={token} />
    </StrictMode>,
  );
}
