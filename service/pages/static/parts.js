// Parts of a page that update themselves: fetched again, and replaced if they have changed.

import {loadAgain, say, tellTimes} from "./page.js";

const WHOLE = new AbortController();
const AWAY = "The service does not answer. The page goes on by itself when it is back.";
const REACHABLE = "a[href], button, input, select, textarea, summary, [tabindex]";
const acts = [];
const ends = new WeakMap();
let asking = null;
let askAgain = false;

function parts(page = document) {
  return [...page.querySelectorAll("[data-part]")];
}

/** Call `act(root, signal)` for every part of the page, and for each part that replaces another.
 *
 * The signal is aborted when the part is replaced, to end its streams and its listeners outside of it.
 */
export function whenShown(act) {
  acts.push(act);
  if (!parts().length) act(document, WHOLE.signal);
  for (const part of parts()) act(part, signalOf(part));
}

function signalOf(part) {
  if (!ends.has(part)) ends.set(part, new AbortController());
  return ends.get(part).signal;
}

/** True if somebody has begun to fill in a form of a part, which a replacement would lose. */
function isEdited(part) {
  return [...part.querySelectorAll("form :is(input, select, textarea)")].some((field) => {
    if (field.type === "checkbox" || field.type === "radio") return field.checked !== field.defaultChecked;
    if (field.type === "range") return false;
    if (field instanceof HTMLSelectElement) return [...field.options].some((one) => one.selected !== one.defaultSelected) && [...field.options].some((one) => one.defaultSelected);
    return field.value !== field.defaultValue;
  });
}

/** Copy the switches, opened details and focus of a part into its replacement. */
function takeOver(before, after) {
  const known = (part) => [...part.querySelectorAll("input, select")].filter((field) => !field.form && (field.id || field.name));
  for (const field of known(before)) {
    const same = known(after).find((one) => one.id === field.id && one.name === field.name);
    if (same && field.type === "checkbox") same.checked = field.checked;
    else if (same) same.value = field.value;
  }
  const [opened, toOpen] = [before, after].map((part) => [...part.querySelectorAll("details")]);
  if (opened.length === toOpen.length) toOpen.forEach((one, number) => { one.open = opened[number].open || (one.open && !one.matches(".fold")); });
  const focused = [...before.querySelectorAll(REACHABLE)].indexOf(document.activeElement);
  return focused < 0 ? () => {} : () => [...after.querySelectorAll(REACHABLE)][focused]?.focus({preventScroll: true});
}

function replace(part, other) {
  const focus = takeOver(part, other);
  signalOf(part);
  ends.get(part).abort();
  part.replaceWith(other);
  focus();
  for (const act of acts) act(other, signalOf(other));
}

async function fetchAndReplace() {
  const answer = await fetch(location.href).catch(() => null);
  // After the end of the session, or a deletion, reload the page to show it.
  if (answer && (answer.redirected || answer.status === 404)) return loadAgain();
  if (!answer || !answer.ok) return say(AWAY, true);
  if (document.getElementById("says").textContent === AWAY) say("");
  const there = new DOMParser().parseFromString(await answer.text(), "text/html");
  let isWhole = true;
  for (const part of parts()) {
    const other = parts(there).find((one) => one.dataset.part === part.dataset.part);
    if (!other || other.dataset.edition === part.dataset.edition) continue;
    if (isEdited(part)) isWhole = false;
    else replace(part, other);
  }
  const [seen, now] = [document, there].map((page) => page.querySelector("[data-tag]"));
  // The ETag for changes stays that of the venue that a kept form shows.
  if (seen && now && isWhole) seen.dataset.tag = now.dataset.tag;
  tellTimes();
  return null;
}

/** Update all parts of the page; calls during an update start one more. */
export async function refresh() {
  askAgain = Boolean(asking);
  if (asking) return asking;
  do {
    askAgain = false;
    asking = fetchAndReplace();
    await asking.catch((error) => say(error.message, true));
  } while (askAgain);
  asking = null;
  return null;
}
