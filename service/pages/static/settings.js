// The settings of a venue: alarms, lenses, and its end. Each is saved by itself, on the venue that the page shows.

import {ask, call, root} from "./page.js";

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
      refused.textContent = refusal.message;
      refused.hidden = false;
    }
  });
}

async function change(patch) {
  await call("PATCH", address, patch, ifSame());
  location.reload();
}

const alarms = document.getElementById("alarms");
onSubmit(alarms, () => {
  const typed = [...alarms.querySelectorAll("input:not([type=checkbox])")].map(({name, value}) => [name, value.trim()]);
  const rules = typed.map(([name, value]) => [name, value === "" ? null : name === "callback_url" ? value : Number(value.replace(",", "."))]);
  const unreadable = rules.find(([, value]) => Number.isNaN(value));
  if (unreadable) throw new Error(`“${alarms.elements[unreadable[0]].value}” is not a number.`);
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
