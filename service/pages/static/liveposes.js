// Live poses of a venue: each report updates the figures, and each minute the curves.

import {ago} from "./page.js";
import {refresh, whenShown} from "./parts.js";
import {listen} from "./stream.js";

const A_MINUTE = 60000;
const NONE = "–";

/** Change the text of an element, unless it has it already. */
function tell(row, part, words) {
  const place = row.querySelector(`[data-${part}]`);
  if (place.textContent !== words) place.textContent = words;
}

function rowsOf(box) {
  return [...box.querySelectorAll("[data-camera]")];
}

function showCamera(row, camera, isRunning) {
  const status = isRunning ? camera.status : "ended";
  for (const badge of row.querySelectorAll("[data-status]")) badge.hidden = badge.dataset.status !== status;
  tell(row, "turned", camera.turned_deg === null ? NONE : `${camera.turned_deg.toFixed(3)}°`);
  tell(row, "latency", camera.latency_ms ? `${camera.latency_ms.p50.toFixed()} / ${camera.latency_ms.p99.toFixed()} ms` : NONE);
  for (const words of row.querySelectorAll("[data-clock]")) words.hidden = words.dataset.clock !== (camera.clock || "");
}

function show(box, state) {
  const rows = rowsOf(box);
  if (rows.map((row) => row.dataset.camera).join() !== state.cameras.map(({id}) => id).join()) return refresh();
  // The panel is above the pictures while poses are sent, and below them afterwards.
  if (box.querySelector("[data-running]").hidden === state.running) return refresh();
  tell(box, "host", state.host);
  tell(box, "destinations", state.destinations.join(", "));
  const time = box.querySelector("time");
  time.dateTime = state.reported_at;
  time.textContent = ago(new Date(state.reported_at));
  rows.forEach((row, number) => showCamera(row, state.cameras[number], state.running));
  return null;
}

async function drawCurves(box) {
  const answer = await fetch(box.dataset.curves).catch(() => null);
  if (!answer || !answer.ok) return;
  const curves = await answer.json();
  for (const row of rowsOf(box)) {
    const curve = curves[row.dataset.camera];
    row.querySelector("[data-turns]").hidden = !curve;
    if (!curve) continue;
    const [x, y] = curve.line.dot;
    const dot = row.querySelector("circle");
    row.querySelector("path").setAttribute("d", curve.line.path);
    dot.setAttribute("cx", x);
    dot.setAttribute("cy", y);
    tell(row, "turns-words", curve.words);
  }
}

whenShown((root, signal) => {
  for (const box of root.querySelectorAll("[data-reports]")) {
    listen(box.dataset.reports, {live: ({data}) => show(box, JSON.parse(data))}, signal);
    const timer = setInterval(() => document.hidden || drawCurves(box), A_MINUTE);
    signal.addEventListener("abort", () => clearInterval(timer));
  }
});
