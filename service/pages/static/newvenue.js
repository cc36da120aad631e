// The way to a first calibration. What is gathered stays here until the venue is created.

import {call, Refused, signed} from "./page.js";
import {Camera, common, complain, drawPlan, later, number} from "./posing.js";

const pitchForm = document.getElementById("pitch");
const createButton = document.getElementById("create");
const missing = document.getElementById("missing");
const {cameras} = common;
let isTaken = false;

// The pitch

function fieldAsTyped() {
  const value = (name) => number(pitchForm.elements[name].value);
  const field = {template: pitchForm.elements.template.value};
  for (const name of ["length_m", "width_m", "line_width_m"]) if (value(name) !== undefined) field[name] = value(name);
  const height = value("ridge_height");
  if (height) {
    const usual = common.plan ? common.plan.field.length_m - common.plan.field.width_m : 37;
    const half = (value("ridge_length") ?? usual) / 2;
    field.ridge = [[-half, 0, height], [half, 0, height]];
  }
  return field;
}

async function readPitch() {
  const wrong = pitchForm.querySelector(".wrong");
  try {
    common.plan = await call("POST", "/ui/new-venue/plan", fieldAsTyped());
    complain(wrong, "");
  } catch (refused) {
    common.plan = null;
    complain(wrong, refused.message);
    return tell();
  }
  for (const name of ["length_m", "width_m", "line_width_m"]) pitchForm.elements[name].placeholder = common.plan.field[name];
  drawPlan(document.getElementById("plan"));
  for (const camera of cameras) camera.offerPoints();
  return tell();
}

/** What is still to be done. */
function tell() {
  const open = [];
  const {id} = pitchForm.elements;
  if (isTaken) open.push("an id that no other venue has");
  if (!id.value || !id.checkValidity()) open.push("an id of small letters, digits, - and _");
  if (!common.plan) open.push("a pitch");
  if (!cameras.length) open.push("a camera");
  if (new Set(cameras.map((camera) => camera.id)).size < cameras.length) open.push("cameras of different names");
  for (const camera of cameras) {
    if (!camera.id || !camera.field("id").checkValidity()) open.push("an id of each camera");
    else if (!camera.file) open.push(`a frame of ${camera.id}`);
    else if (!camera.result) open.push(`the first pose of ${camera.id}`);
  }
  createButton.disabled = open.length > 0;
  missing.textContent = open.length ? `Still missing: ${open.join("; ")}.` : "";
}

async function create() {
  const refused = document.getElementById("refused");
  const id = pitchForm.elements.id.value;
  createButton.disabled = refused.hidden = true;
  try {
    const venue = {id, name: pitchForm.elements.name.value, field: common.plan.field, cameras: cameras.map((camera) => camera.wire)};
    const answer = await fetch(`/venues/${id}`, {method: "PUT", headers: {...signed, "Content-Type": "application/json", ...(create.done ? {} : {"If-None-Match": "*"})}, body: JSON.stringify(venue)});
    if (!answer.ok) throw new Refused(await answer.json(), answer.status);
    create.done = true;
    const body = new FormData();
    for (const camera of cameras) body.append(camera.id, camera.file);
    missing.textContent = "Sending the frames …";
    const job = await call("POST", `/venues/${id}/calibrate`, body);
    location.assign(`/ui/jobs/${job.id}`);
  } catch (problem) {
    refused.textContent = problem.message;
    refused.hidden = false;
    tell();
  }
}

/** Say at once that an id is another venue's, and not after all the clicks. */
async function readId() {
  const {id} = pitchForm.elements;
  const place = document.getElementById("taken");
  const asked = id.value;
  const answer = asked && id.checkValidity() ? await call("GET", `/ui/new-venue/taken?id=${encodeURIComponent(asked)}`) : {taken: false};
  if (asked !== id.value) return;
  isTaken = answer.taken;
  place.hidden = !isTaken;
  place.querySelector("a").href = `/ui/venues/${asked}/first-pose`;
  tell();
}

pitchForm.addEventListener("input", later(readPitch));
pitchForm.elements.id.addEventListener("input", later(() => readId().catch(() => {})));
pitchForm.addEventListener("submit", (event) => event.preventDefault());
document.getElementById("add").addEventListener("click", () => {
  cameras.push(new Camera(["left", "right", "middle"][cameras.length] || `camera-${cameras.length + 1}`));
  tell();
});
createButton.addEventListener("click", create);
common.tell = tell;
cameras.push(new Camera("left"));
readPitch();
