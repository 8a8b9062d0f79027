// SPDX-License-Identifier: Apache-2.0
import { StrictMode } from "react";
import { createRoot } from "react-dom/client";
import { takeToken } from "./control/token";
import "./design/tokens.css";
import "./design/base.css";
import { Gate } from "./shell/Gate";
import { applyTheme } from "./shell/theme";

applyTheme();
const token = takeToken();
const place = document.getElementById("studio");
if (!place) throw new Error("index.html has no element 'studio'");
createRoot(place).render(
  <StrictMode>
    <Gate token={token} />
  </StrictMode>,
);
