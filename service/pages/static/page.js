// What every page does: times that stay right, buttons that call the interface, lists that follow what happens.

const token = document.querySelector('meta[name="token"]').content;
const OFTEN = 5000;

/** What stands in the way of a call, as the service says it. */
export class Refused extends Error {
  constructor(problem, status) {
    super(problem.detail || problem.title || `The service answered ${status}.`);
    this.problem = problem;
    this.status = status;
  }
}

/** Headers that a page of a session sends with what it changes. */
export const signed = token ? {"X-CSRF-Token": token} : {};

/** Call the interface; returns the JSON of the answer, null without a body. `more`: headers. */
export async function call(method, address, content, more = {}) {
  const body = content === undefined || content instanceof FormData ? content : JSON.stringify(content);
  const type = method === "PATCH" ? "application/merge-patch+json" : "application/json";
  const headers = {...signed, ...(typeof body === "string" ? {"Content-Type": type} : {}), ...more};
  let answer;
  try {
    answer = await fetch(address, {method, headers, body});
  } catch {
    throw new Refused({detail: "The service cannot be reached."}, 0);
  }
  const text = await answer.text();
  const json = (answer.headers.get("Content-Type") || "").includes("json") ? JSON.parse(text) : null;
  if (!answer.ok) throw new Refused(json || {}, answer.status);
  return json;
}

/** Say something that has no place of its own on the page. */
export function say(text, bad = false) {
  const place = document.getElementById("says");
  place.textContent = text;
  place.classList.toggle("bad", bad);
}

/** A colour, or another property, of the style that is in force. */
export function styled(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

/** Draw again when the page turns dark or light. */
export function onScheme(draw) {
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
}

export function ago(moment, now = Date.now()) {
  const seconds = Math.max(0, (now - moment) / 1000);
  if (seconds < 5) return "just now";
  const [, length, unit] = [[60, 1, "s"], [3600, 60, "min"], [86400, 3600, "h"], [Infinity, 86400, "d"]].find(([end]) => seconds < end);
  return `${Math.round(seconds / length)} ${unit} ago`;
}

/** A moment by the clock where the viewer is: 2026-11-21 11:00:09 GMT+1. */
export function onTheClock(moment) {
  const zone = new Intl.DateTimeFormat("en", {timeZoneName: "short"}).formatToParts(moment);
  // Swedish is written as ISO 8601 is.
  return `${moment.toLocaleString("sv")} ${zone.find(({type}) => type === "timeZoneName").value}`;
}

function tellTimes() {
  for (const time of document.querySelectorAll("time")) {
    const moment = new Date(time.dateTime);
    if ("ago" in time.dataset) time.textContent = ago(moment);
    else time.textContent = onTheClock(moment);
    time.title = "ago" in time.dataset ? onTheClock(moment) : `${time.dateTime.slice(0, 19).replace("T", " ")} UTC`;
  }
}

async function press(button) {
  if (button.dataset.asks && !confirm(button.dataset.asks)) return;
  button.disabled = true;
  try {
    const content = button.dataset.content ? JSON.parse(button.dataset.content) : undefined;
    const answer = await call(button.dataset.method || "POST", button.dataset.call, content);
    if ("follow" in button.dataset) location.assign(`/ui/jobs/${answer.id}`);
    else if (button.dataset.then) location.assign(button.dataset.then);
    else location.reload();
  } catch (refused) {
    say(refused.message, true);
    button.disabled = false;
  }
}

/** Parts marked with data-refresh are fetched again and again, unless somebody is in them. */
async function refresh() {
  const here = document.querySelector("[data-refresh]");
  if (!here || document.hidden || here.contains(document.activeElement)) return;
  const answer = await fetch(location.href).catch(() => null);
  if (!answer || !answer.ok || answer.redirected) return;
  const there = new DOMParser().parseFromString(await answer.text(), "text/html").querySelector("[data-refresh]");
  if (there && there.innerHTML !== here.innerHTML && !here.contains(document.activeElement)) here.replaceWith(there);
  tellTimes();
}

document.addEventListener("click", (event) => {
  const button = event.target.closest("button[data-call]");
  if (button) press(button);
});
tellTimes();
setInterval(tellTimes, OFTEN);
if (document.querySelector("[data-refresh]")) setInterval(refresh, OFTEN);
