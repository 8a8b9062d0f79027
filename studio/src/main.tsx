// SPDX-License-Identifier: Apache-2.0
import { takeToken } from "./control/token";
import "./design/tokens.css";
import "./design/base.css";
import { applyLanguage } from "./language/language";
import { applyTheme } from "./shell/theme";

applyTheme();
const token = takeToken();
const place = document.getElementById("studio");
if (!place) throw new Error("index.html has no element 'studio'");
await applyLanguage();
// Loaded after the language, because its module constants contain texts.
const { showStudio } = await import("./studio");
showStudio(place, token);
