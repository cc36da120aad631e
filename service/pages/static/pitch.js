// The pitch of a new venue: its id, sport and dimensions, checked while typing.

import {asLabelled, call, complain, root} from "./page.js";
import {drawPlan, later, number} from "./steps.js";

export const pitchForm = document.getElementById("pitch");

/** State of the form; `plan`: the pitch from above, null for invalid input. */
export const pitch = {plan: null, isTaken: false};

/** The field for the interface. */
function fieldAsTyped() {
  const value = (name) => number(pitchForm.elements[name].value);
  const field = {template: pitchForm.elements.template.value};
  for (const name of ["length_m", "width_m", "line_width_m"]) if (value(name) !== undefined) field[name] = value(name);
  const height = value("ridge_height");
  if (height) {
    const usual = pitch.plan ? pitch.plan.field.length_m - pitch.plan.field.width_m : 37;
    const half = (value("ridge_length") ?? usual) / 2;
    field.ridge = [[-half, 0, height], [half, 0, height]];
  }
  return field;
}

async function readPitch(changed) {
  const wrong = pitchForm.querySelector(".wrong");
  try {
    pitch.plan = await call("POST", `${root}/ui/new-venue/plan`, fieldAsTyped());
    complain(wrong, "");
  } catch (refused) {
    pitch.plan = null;
    complain(wrong, asLabelled(pitchForm, refused.message));
    return changed();
  }
  for (const name of ["length_m", "width_m", "line_width_m"]) pitchForm.elements[name].placeholder = pitch.plan.field[name];
  drawPlan(document.getElementById("plan"), pitch.plan);
  return changed();
}

/** Warn at once about an id that another venue has. */
async function readId(changed) {
  const {id} = pitchForm.elements;
  const place = document.getElementById("taken");
  const asked = id.value;
  const answer = asked && id.checkValidity() ? await call("GET", `${root}/ui/new-venue/taken?id=${encodeURIComponent(asked)}`) : {taken: false};
  if (asked !== id.value) return;
  pitch.isTaken = answer.taken;
  place.hidden = !pitch.isTaken;
  place.querySelector("a").href = `${root}/ui/venues/${asked}/first-pose`;
  changed();
}

/** Returns the missing input about the pitch. */
export function missingOfPitch() {
  const open = [];
  const {id} = pitchForm.elements;
  if (pitch.isTaken) open.push("an id that no other venue has");
  if (id && (!id.value || !id.checkValidity())) open.push("an id of small letters, digits, - and _");
  if (!pitch.plan) open.push("a pitch");
  return open;
}

/** Call `changed()` after each change of the form, and once at the beginning. */
export function readForm(changed) {
  pitchForm.addEventListener("input", later(() => readPitch(changed)));
  pitchForm.elements.id?.addEventListener("input", later(() => readId(changed).catch(() => {})));
  pitchForm.addEventListener("submit", (event) => event.preventDefault());
  readPitch(changed);
}
