// The settings of a venue: its name and field, alarms, lenses, and its end. Each is saved by itself, on the venue that the page shows.

import {ask, asLabelled, call, root} from "./page.js";

const box = document.getElementById("settings");
const address = `${root}/venues/${box.dataset.venue}`;
const ifSame = () => ({"If-Match": box.dataset.tag});
const end = document.getElementById("delete");

/** Do what a form is for; what stands in the way is said in it. */
function onSubmit(form, act) {
  const refused = form.querySelector("[data-refused]");
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    refused.hidden = true;
    try {
      await act();
    } catch (refusal) {
      refused.textContent = asLabelled(form, refusal.message);
      refused.hidden = false;
    }
  });
}

/** The number in a box, null of an empty one. */
function numberIn({value}) {
  const typed = value.trim();
  const number = Number(typed.replace(",", "."));
  if (Number.isNaN(number)) throw new Error(`“${typed}” is not a number.`);
  return typed === "" ? null : number;
}

async function change(patch) {
  await call("PATCH", address, patch, ifSame());
  location.reload();
}

const MEASURES = ["length_m", "width_m", "line_width_m"];
const venue = document.getElementById("venue");

/** What was changed of the field: a blank measure, or one that was left as it was while the sport changed, is the sport's. */
function changedField({template, ...fields}) {
  const isSportChanged = !template.disabled && ![...template.options].some((one) => one.selected && one.defaultSelected);
  const changed = MEASURES.filter((name) => isSportChanged || fields[name].value.trim() !== fields[name].defaultValue);
  const numbers = changed.map((name) => [name, fields[name].value.trim() === fields[name].defaultValue ? null : numberIn(fields[name])]);
  return {...Object.fromEntries(numbers), ...(isSportChanged ? {template: template.value, measures_m: null, ridge: null, uneven_m: null} : {})};
}

onSubmit(venue, async () => {
  const {name, template, length_m, width_m, line_width_m} = venue.elements;
  const field = changedField({template, length_m, width_m, line_width_m});
  const isField = Object.keys(field).length > 0;
  const effect = "The poses stay, but belong to another field: the next calibration may move or refuse them, and then new first poses help. What the cameras remember of earlier nights and their trends are gone for good.";
  if (isField && !await ask({asks: "Change the field?", effect, does: "Change the field"})) return;
  await change({name: name.value.trim() || null, ...(isField ? {field} : {})});
});

const alarms = document.getElementById("alarms");
onSubmit(alarms, () => {
  const typed = [...alarms.querySelectorAll("input:not([type=checkbox])")].map(({name, value}) => [name, value.trim()]);
  const rules = typed.map(([name, value]) => [name, name === "callback_url" ? value || null : numberIn(alarms.elements[name])]);
  for (const name of ["knocked", "live"]) rules.push([name, alarms.elements[name].checked || null]);
  return change({alarms: rules.some(([, value]) => value !== null) ? Object.fromEntries(rules) : null});
});

/** The lens in what somebody typed or chose; what it leaves out is not taken from the lens before. */
function readLens(form) {
  let given;
  try {
    given = JSON.parse(form.elements.lens.value);
  } catch (error) {
    throw new Error(`This is not JSON: ${error.message}`);
  }
  const size = given.image_size;
  const expected = [Number(form.dataset.width), Number(form.dataset.height)];
  if (size && size.join() !== expected.join()) throw new Error(`This lens is of pictures of ${size.join(" × ")} pixels; the camera has ${expected.join(" × ")}.`);
  return {model: "opencv", distortion: [], sigma: null, ...(given.intrinsics || given)};
}

for (const form of box.querySelectorAll("[data-lens-of]")) {
  const file = form.querySelector("input[type=file]");
  file.addEventListener("change", async () => { if (file.files[0]) form.elements.lens.value = await file.files[0].text(); });
  onSubmit(form, () => change({cameras: {[form.dataset.lensOf]: {intrinsics: readLens(form)}}}));
}

end.elements.typed.addEventListener("input", () => { end.querySelector("button").disabled = end.elements.typed.value !== box.dataset.venue; });
onSubmit(end, async () => {
  // By keys a form is sent whatever its button says.
  if (end.elements.typed.value !== box.dataset.venue) throw new Error(`Type ${box.dataset.venue}.`);
  const effect = "Its poses, their history and its trends are gone for good. Nobody can restore them.";
  if (!await ask({asks: `Delete ${box.dataset.venue}?`, effect, does: "Delete for good", isDanger: true})) return;
  await call("DELETE", address, undefined, ifSame());
  location.assign(`${root}/`);
});
