// The stitched view of a venue: its knobs, what they do to the last frames, and the packages of it for other tools.

import {call} from "./page.js";

const PAUSE = 250;
const form = document.getElementById("view-form");
const angles = document.getElementById("view-angles");
const refused = document.getElementById("view-refused");
const picture = document.getElementById("view-picture");
const seam = document.getElementById("view-seam");
const packages = document.querySelectorAll("#view-packages [data-format]");
const OF_SIZE = ["width_px", "height_px"];
const OF_ANGLES = ["field_of_view_deg", "pan_deg", "horizon"];
let shown = "";
let drawing = false;
let pause;

/** The view that is chosen, as a venue keeps it; null: as it suits the cameras. */
function chosen() {
  const numbers = [...OF_SIZE, ...OF_ANGLES].map((name) => [name, form.elements[name].value]);
  const view = Object.fromEntries(numbers.map(([name, value]) => [name, value === "" ? null : Number(value)]));
  return {projection: form.elements.projection.value, ...view, pan_deg: view.pan_deg ?? 0};
}

/** The same as a request has it. */
function query(more) {
  const parts = Object.entries({...chosen(), ...more}).map(([name, value]) => [name, value === null ? "auto" : value]);
  return new URLSearchParams(parts);
}

function refuse(text) {
  refused.textContent = text;
  refused.hidden = !text;
}

/** Show the view, and then the one that was chosen meanwhile. */
async function draw() {
  if (!picture || drawing) return;
  drawing = true;
  picture.setAttribute("aria-busy", "true");
  for (let wanted; (wanted = `${picture.dataset.address}?${query({seam: seam.checked})}`) !== shown && form.checkValidity(); shown = wanted) {
    try {
      const answer = await fetch(wanted);
      if (!answer.ok) throw new Error((await answer.json()).detail);
      const view = await createImageBitmap(await answer.blob());
      picture.width = view.width;
      picture.height = view.height;
      picture.getContext("2d").drawImage(view, 0, 0);
      refuse("");
    } catch (error) {
      refuse(error.message);
    }
  }
  picture.setAttribute("aria-busy", "false");
  drawing = false;
}

function changed() {
  angles.disabled = form.elements.projection.value === "birds-eye";
  for (const link of packages) link.href = `/venues/${form.dataset.venue}/stitch?${query({format: link.dataset.format})}`;
  clearTimeout(pause);
  pause = setTimeout(draw, PAUSE);
}

/** A knob and the number beside it say the same. */
function turned({target}) {
  const {knob} = target.dataset;
  if (knob) form.elements[knob].value = target.value;
  else if (OF_ANGLES.includes(target.name) && target.value !== "") form.querySelector(`[data-knob="${target.name}"]`).value = target.value;
  changed();
}

async function keep(event) {
  event.preventDefault();
  try {
    await call("PATCH", `/venues/${form.dataset.venue}`, {view: chosen()}, {"If-Match": form.dataset.tag});
    location.reload();
  } catch ({problem, status, message}) {
    refuse(status === 412 ? "Somebody has changed the venue. Load the page again." : (problem.errors || []).map((error) => error.message).join(" ") || message);
  }
}

if (form) {
  form.addEventListener("input", turned);
  form.addEventListener("submit", keep);
  // The values are back after the event.
  form.addEventListener("reset", () => setTimeout(changed));
  angles.disabled = form.elements.projection.value === "birds-eye";
}
if (picture) {
  seam.addEventListener("change", draw);
  // Not before somebody sees it: the frames are stitched anew.
  new IntersectionObserver(([{isIntersecting}]) => isIntersecting && draw()).observe(picture);
}
