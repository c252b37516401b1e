import { startLive } from "./live";
import { startReplay } from "./replay/replay";
import type { PageMode } from "./types";

const mode = JSON.parse(document.getElementById("sls-mode")?.textContent ?? '{"mode":"live"}') as PageMode;
if (mode.mode === "live") startLive();
else void startReplay(mode);
