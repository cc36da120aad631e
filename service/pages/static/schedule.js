// The schedule of a venue: saving it with the sources that it needs, and trying it.

import {call, complain, root, say} from "./page.js";
import {whenShown} from "./parts.js";

/** The changes of the venue by the form; options of the schedule are kept. */
function patch(form) {
  const {cron, time_zone: zone, exact} = form.elements;
  const sources = [...form.querySelectorAll("[data-camera]")].filter((field) => field.value !== field.defaultValue);
  const cameras = Object.fromEntries(sources.map((field) => [field.dataset.camera, {source: field.value.trim() || null}]));
  const schedule = {cron: cron.value.trim(), time_zone: zone.value.trim() || "UTC", exact: exact.checked};
  return {schedule, ...(sources.length ? {cameras} : {})};
}

async function save(event, refused) {
  event.preventDefault();
  const form = event.currentTarget;
  refused.hidden = true;
  try {
    await call("PATCH", `${root}/venues/${form.dataset.venue}`, patch(form));
    location.reload();
  } catch (refusal) {
    complain(refused, refusal.message);
  }
}

async function tryNow(trying) {
  trying.disabled = true;
  const body = new FormData();
  body.append("options", trying.dataset.options);
  say("Fetching the frames …");
  try {
    const job = await call("POST", `${root}/venues/${trying.dataset.venue}/calibrate`, body);
    location.assign(`${root}/ui/jobs/${job.id}`);
  } catch (refusal) {
    say(refusal.message, true);
    trying.disabled = false;
  }
}

function offerZones(form, list) {
  const zone = form.elements.time_zone;
  // A default that the script fills in does not count as an edit.
  zone.defaultValue ||= Intl.DateTimeFormat().resolvedOptions().timeZone || "UTC";
  for (const name of Intl.supportedValuesOf("timeZone")) {
    const option = document.createElement("option");
    option.value = name;
    list.append(option);
  }
}

whenShown((root) => {
  const form = root.querySelector("#schedule-form");
  const trying = root.querySelector("#try-schedule");
  if (form) {
    offerZones(form, root.querySelector("#zones"));
    form.addEventListener("submit", (event) => save(event, root.querySelector("#schedule-refused")));
  }
  trying?.addEventListener("click", () => tryNow(trying));
});
