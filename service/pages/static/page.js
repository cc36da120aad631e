// Code of every page: relative times, and buttons that call the interface.

const token = document.querySelector('meta[name="token"]').content;
/** Root path of the service behind a proxy; empty: none. */
export const {root} = document.documentElement.dataset;
const OFTEN = 5000;
let leftAt = -Infinity;

// Problems of the interface in words for people.
const IN_WORDS = {
  "venue-moved-on": "The venue has been changed since this job. Load the page again to see how it is now.",
  "venue-changed": "Somebody has changed the venue meanwhile. Load the page again.",
  "venue-busy": "A job of this venue is still going on. Wait for its end or cancel it.",
  "venue-not-found": "The venue was deleted.",
  "job-not-found": "The job was deleted.",
  "job-open": "The job has not ended.",
  "revision-not-found": "The venue no longer has this revision.",
  "refined-not-found": "No refined lens of this camera is kept any more. The next calibration that is accepted brings one.",
};
const OF_PROGRAMS = /\b(GET|PUT|POST|PATCH|DELETE) \//;

/** The detail of a problem without sentences about HTTP requests. */
export function inWords(problem) {
  const known = IN_WORDS[(problem.type || "").split("/").at(-1)];
  if (known) return known;
  const faults = (problem.errors || []).map((error) => error.message).join(" ");
  const said = (faults || problem.detail || "").split(/(?<=[.!?])\s+/).filter((sentence) => !OF_PROGRAMS.test(sentence));
  return said.join(" ") || problem.title;
}

/** Error of a call, with the problem of the answer. */
export class Refused extends Error {
  constructor(problem, status) {
    super(inWords(problem) || `The service answered ${status}.`);
    this.problem = problem;
    this.status = status;
  }
}

/** A message with the labels of form fields in place of their names: "Length, m" and not "field.length_m". */
export function asLabelled(form, message) {
  let words = message;
  for (const {name, labels} of form.elements) {
    const label = name && labels?.[0]?.firstChild.textContent.trim();
    if (label) words = words.replace(new RegExp(`(^|\\s)(?:\\w+\\.)*${name}:`, "g"), `$1${label}:`);
  }
  return words;
}

/** Show words where they belong; without any, hide the place. */
export function complain(place, text) {
  place.textContent = text || "";
  place.hidden = !text;
}

/** Headers of requests that change something: the CSRF token of the session. */
export const signed = token ? {"X-CSRF-Token": token} : {};

/** Call the interface and return the JSON of the answer, null without a body. `more`: headers. */
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
  const json = text && (answer.headers.get("Content-Type") || "").includes("json") ? JSON.parse(text) : null;
  if (!answer.ok) throw new Refused(json || {}, answer.status);
  return json;
}

/** Show a message in the status line of the page. */
export function say(text, bad = false) {
  const place = document.getElementById("says");
  place.textContent = text;
  place.classList.toggle("bad", bad);
}

/** The current value of a CSS variable, such as a colour. */
export function styled(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

/** Redraw when the colour scheme changes, until the signal is aborted. */
export function onScheme(draw, signal) {
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw, {signal});
}

export function ago(moment, now = Date.now()) {
  const seconds = Math.trunc((now - moment) / 1000);
  if (seconds < 5) return "just now";
  if (seconds < 60) return `${seconds} s ago`;
  const minutes = Math.floor(seconds / 60);
  const hours = Math.floor(minutes / 60);
  if (hours >= 24) return `${Math.floor(hours / 24)} d ago`;
  return hours ? `${hours} h ${minutes % 60} min ago` : `${minutes} min ago`;
}

/** A moment in the viewer's time zone: 2026-11-21 11:00:09 GMT+1. */
export function onTheClock(moment) {
  const zone = new Intl.DateTimeFormat("en", {timeZoneName: "short"}).formatToParts(moment);
  // The Swedish locale writes dates like ISO 8601.
  return `${moment.toLocaleString("sv")} ${zone.find(({type}) => type === "timeZoneName").value}`;
}

export function tellTimes() {
  for (const time of document.querySelectorAll("time")) {
    const moment = new Date(time.dateTime);
    if ("ago" in time.dataset) time.textContent = ago(moment);
    else time.textContent = onTheClock(moment);
    time.title = "ago" in time.dataset ? onTheClock(moment) : `${time.dateTime.slice(0, 19).replace("T", " ")} UTC`;
  }
}

/** Reload the page, but not right after a click on a link, which would be lost. */
export function loadAgain() {
  if (performance.now() - leftAt < OFTEN) setTimeout(loadAgain, OFTEN);
  else location.reload();
}

/** Ask for confirmation in a dialog; resolves to true if confirmed. `does`: label of the confirming button. */
export function ask({asks, effect, does, refrain = "Cancel", isDanger = false}) {
  const box = document.createElement("dialog");
  const [question, words, form] = [["h2", asks], ["p", effect], ["form", ""]].map(([tag, text]) => Object.assign(document.createElement(tag), {textContent: text}));
  question.id = "asked-question";
  words.id = "asked-effect";
  box.setAttribute("aria-labelledby", question.id);
  box.setAttribute("aria-describedby", words.id);
  form.method = "dialog";
  form.className = "send";
  const buttons = [[does, "yes", isDanger ? "danger" : ""], [refrain, "", "quiet"]].map(([textContent, value, className]) => Object.assign(document.createElement("button"), {textContent, value, className}));
  form.append(...buttons);
  box.append(question, words, form);
  document.body.append(box);
  box.showModal();
  return new Promise((answered) => {
    box.addEventListener("close", () => {
      box.remove();
      answered(box.returnValue === "yes");
    });
  });
}

async function press(button) {
  const {asks, effect, refrain} = button.dataset;
  const does = button.getAttribute("aria-label") || button.textContent.trim();
  if (asks && !await ask({asks, effect, does, refrain, isDanger: button.matches(".danger")})) return;
  button.disabled = true;
  try {
    const content = button.dataset.content ? JSON.parse(button.dataset.content) : undefined;
    const answer = await call(button.dataset.method || "POST", button.dataset.call, content);
    if ("follow" in button.dataset) location.assign(`${root}/ui/jobs/${answer.id}`);
    else if (button.dataset.then) location.assign(button.dataset.then);
    else location.reload();
  } catch (refused) {
    say(refused.message, true);
    button.disabled = false;
  }
}

document.addEventListener("click", (event) => {
  const button = event.target.closest("button[data-call]");
  if (button) press(button);
});
window.addEventListener("beforeunload", () => { leftAt = performance.now(); });
tellTimes();
setInterval(tellTimes, OFTEN);
