// Result of a search for cameras: choose a candidate of each camera, and store all of them.

import {call, complain, root} from "./page.js";

const form = document.getElementById("found");
const button = form?.querySelector("button[type=submit]");
const cameras = [...(form?.querySelectorAll("[data-camera]") || [])].map((section) => section.dataset.camera);

/** Number of the chosen candidate of a camera; null for none of them, undefined without a choice. */
function chosen(camera) {
  const radio = form.querySelector(`input[name="${camera}"]:checked`);
  if (!radio) return undefined;
  return radio.value ? Number(radio.value) : null;
}

function tell() {
  const open = cameras.filter((camera) => chosen(camera) === undefined);
  const isNone = cameras.every((camera) => chosen(camera) === null);
  button.disabled = open.length > 0 || isNone;
  const words = open.length ? `Choose a candidate of ${open.join(", ")}, or none.` : isNone ? "None is chosen." : "The blue lines have to lie on the paint.";
  form.querySelector("[data-open]").textContent = words;
}

/** Swap the sides of the cameras, half a turn about the field's centre: choose their other candidates. */
function swap(event) {
  const wasSwapped = event.currentTarget.getAttribute("aria-pressed") === "true";
  event.currentTarget.setAttribute("aria-pressed", !wasSwapped);
  for (const section of form.querySelectorAll("[data-assumed]")) {
    const radios = [1, 2].map((number) => section.querySelector(`input[value="${number}"]`));
    const [from, to] = wasSwapped ? radios.reverse() : radios;
    if (from.checked) to.checked = true;
    from.closest("li").hidden = true;
    to.closest("li").hidden = false;
  }
  tell();
}

async function take(event) {
  event.preventDefault();
  const refused = document.getElementById("refused");
  button.disabled = refused.hidden = true;
  const venue = `${root}/ui/venues/${form.dataset.venue}`;
  const candidates = Object.fromEntries(cameras.map((camera) => [camera, chosen(camera)]));
  try {
    await call("POST", `${root}/venues/${form.dataset.venue}/adopt-found`, {job: form.dataset.job, candidates});
  } catch (problem) {
    complain(refused, problem.message);
    return tell();
  }
  if (!("calibrates" in form.dataset)) return location.assign(venue);
  try {
    const job = await call("POST", `${root}/jobs/${form.dataset.job}/calibrate`);
    return location.assign(`${root}/ui/jobs/${job.id}`);
  } catch (problem) {
    const link = document.createElement("a");
    link.href = venue;
    link.textContent = "To the venue";
    refused.replaceChildren(`The poses are stored, but not calibrated yet. ${problem.message} `, link);
    refused.hidden = false;
  }
}

if (button) {
  form.addEventListener("input", tell);
  form.addEventListener("submit", take);
  form.querySelector("[data-swap]")?.addEventListener("click", swap);
  tell();
}
