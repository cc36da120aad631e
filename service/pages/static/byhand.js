// A new venue by hand, with clicked first poses. Its data stay in the browser until the venue is created.

import {complain} from "./page.js";
import {missingOfPitch, pitch, pitchForm, readForm} from "./pitch.js";
import {Camera, common} from "./posing.js";
import {createAndCalibrate, showMissing} from "./steps.js";

const createButton = document.getElementById("create");
const missing = document.getElementById("missing");
const {cameras} = common;

function changed() {
  if (common.plan !== pitch.plan) {
    common.plan = pitch.plan;
    if (common.plan) for (const camera of cameras) camera.offerPoints();
  }
  tell();
}

/** Returns the steps that are still missing. */
function tell() {
  const open = missingOfPitch();
  if (!cameras.length) open.push("a camera");
  if (new Set(cameras.map((camera) => camera.id)).size < cameras.length) open.push("cameras of different names");
  for (const camera of cameras) {
    if (!camera.id || !camera.field("id").checkValidity()) open.push("an id of each camera");
    else if (!camera.file) open.push(`a frame of ${camera.id}`);
    else if (!camera.result) open.push(`the first pose of ${camera.id}`);
  }
  showMissing(open, missing, createButton);
}

async function create() {
  const refused = document.getElementById("refused");
  const id = pitchForm.elements.id.value;
  createButton.disabled = refused.hidden = true;
  try {
    const venue = {id, name: pitchForm.elements.name.value, field: common.plan.field, cameras: cameras.map((camera) => camera.wire)};
    const frames = cameras.map((camera) => [camera.id, camera.file]);
    await createAndCalibrate(venue, frames, () => { missing.textContent = "Sending the frames …"; });
  } catch (problem) {
    complain(refused, problem.message);
    tell();
  }
}

document.getElementById("add").addEventListener("click", () => {
  cameras.push(new Camera(["left", "right", "middle"][cameras.length] || `camera-${cameras.length + 1}`));
  tell();
});
createButton.addEventListener("click", create);
common.tell = tell;
cameras.push(new Camera("left"));
readForm(changed);
