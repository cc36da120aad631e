// The settings of a venue: name and field, alarms, lenses, and deletion. Each form is saved alone, if the venue is unchanged.

import {ask, asLabelled, call, complain, root} from "./page.js";

const box = document.getElementById("settings");
const address = `${root}/venues/${box.dataset.venue}`;
const ifSame = () => ({"If-Match": box.dataset.tag});
const end = document.getElementById("delete");

/** Submit a form, and show errors in it. */
function onSubmit(form, act) {
  const refused = form.querySelector("[data-refused]");
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    refused.hidden = true;
    try {
      await act();
    } catch (refusal) {
      complain(refused, asLabelled(form, refusal.message));
    }
  });
}

/** The number in an input, null if it is empty. */
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

/** The changes of the field: an empty dimension, or an unchanged one after a change of the sport, becomes the sport's default. */
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

/** The lens that somebody typed or chose; members that it lacks are not taken from the stored lens. */
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
  // The Enter key submits a form even if its button is disabled.
  if (end.elements.typed.value !== box.dataset.venue) throw new Error(`Type ${box.dataset.venue}.`);
  const effect = "Its poses, their history and its trends are gone for good. Nobody can restore them.";
  if (!await ask({asks: `Delete ${box.dataset.venue}?`, effect, does: "Delete for good", isDanger: true})) return;
  await call("DELETE", address, undefined, ifSame());
  location.assign(`${root}/`);
});
