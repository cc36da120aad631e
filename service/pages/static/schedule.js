// The schedule of a venue: saved with the sources that it needs, and tried.

import {call, say} from "./page.js";

const form = document.getElementById("schedule-form");
const refused = document.getElementById("schedule-refused");
const trying = document.getElementById("try-schedule");

/** What the form changes of the venue; options of the schedule stay as they are. */
function patch() {
  const {cron, time_zone: zone, exact} = form.elements;
  const sources = [...form.querySelectorAll("[data-camera]")].filter((field) => field.value !== field.defaultValue);
  const cameras = Object.fromEntries(sources.map((field) => [field.dataset.camera, {source: field.value.trim() || null}]));
  const schedule = {cron: cron.value.trim(), time_zone: zone.value.trim() || "UTC", exact: exact.checked};
  return {schedule, ...(sources.length ? {cameras} : {})};
}

async function save(event) {
  event.preventDefault();
  refused.hidden = true;
  try {
    await call("PATCH", `/venues/${form.dataset.venue}`, patch());
    location.reload();
  } catch ({problem, message}) {
    refused.textContent = (problem.errors || []).map((error) => error.message).join(" ") || message;
    refused.hidden = false;
  }
}

async function tryNow() {
  trying.disabled = true;
  const body = new FormData();
  body.append("options", trying.dataset.options);
  say("Fetching the frames …");
  try {
    const job = await call("POST", `/venues/${trying.dataset.venue}/calibrate`, body);
    location.assign(`/ui/jobs/${job.id}`);
  } catch (refusal) {
    say(refusal.message, true);
    trying.disabled = false;
  }
}

if (form) {
  const here = Intl.DateTimeFormat().resolvedOptions().timeZone;
  const zone = form.elements.time_zone;
  if (!zone.value) zone.value = here || "UTC";
  for (const name of Intl.supportedValuesOf("timeZone")) {
    const option = document.createElement("option");
    option.value = name;
    document.getElementById("zones").append(option);
  }
  form.addEventListener("submit", save);
}
if (trying) trying.addEventListener("click", tryNow);
