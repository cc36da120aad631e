// New first poses of a stored venue, for the cameras that get a frame.

import {call, complain, root} from "./page.js";
import {Camera, common} from "./posing.js";

const box = document.getElementById("cameras");
const venue = JSON.parse(box.dataset.venue);
const storeButton = document.getElementById("store");
const missing = document.getElementById("missing");

/** A camera of the venue with its stored lens. */
function asStored({id, image_size: size, intrinsics}) {
  const camera = new Camera(id);
  camera.field("id").readOnly = true;
  camera.one("[data-remove]").hidden = true;
  camera.expectedSize = size;
  camera.intrinsics = intrinsics;
  camera.lensAsStored = JSON.stringify(camera.intrinsics);
  return camera;
}

/** The changes of a camera: its pose, and its lens if somebody or the points have corrected it. */
function patch(camera) {
  const {rotation, position} = camera.result.pose;
  const isCorrected = camera.result.lens || JSON.stringify(camera.intrinsics) !== camera.lensAsStored;
  return {pose: {rotation, position}, ...(isCorrected ? {intrinsics: camera.result.intrinsics} : {})};
}

function tell() {
  const begun = common.cameras.filter((camera) => camera.file);
  const open = begun.filter((camera) => !camera.result).map((camera) => camera.id);
  storeButton.disabled = !begun.length || open.length > 0;
  missing.textContent = !begun.length ? "No frame yet." : open.length ? `Still missing: the first pose of ${open.join(", ")}.` : `New poses of ${begun.map((camera) => camera.id).join(", ")}.`;
}

async function store() {
  const refused = document.getElementById("refused");
  storeButton.disabled = refused.hidden = true;
  const cameras = Object.fromEntries(common.cameras.filter((camera) => camera.result).map((camera) => [camera.id, patch(camera)]));
  try {
    await call("PATCH", `${root}/venues/${venue.id}`, {cameras}, {"If-Match": box.dataset.tag});
    location.assign(`${root}/ui/venues/${venue.id}`);
  } catch (refusal) {
    complain(refused, refusal.message);
    tell();
  }
}

common.tell = tell;
storeButton.addEventListener("click", store);
common.plan = await call("POST", `${root}/ui/new-venue/plan`, venue.field);
for (const camera of venue.cameras) common.cameras.push(asStored(camera));
for (const camera of common.cameras) camera.offerPoints();
tell();
