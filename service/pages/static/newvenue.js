// A new venue by its sport and a frame of each camera: submits a search for the cameras, or creates it with the poses of
// a calibration that another tool has made.

import {call, complain, root} from "./page.js";
import {objection, onFiles, sizeOf, thumbnail} from "./frames.js";
import {missingOfPitch, pitch, pitchForm, readForm} from "./pitch.js";
import {createAndCalibrate, idLike, number, showMissing} from "./steps.js";

const box = document.getElementById("frames");
const list = box.querySelector("ul");
const input = box.querySelector("input[type=file]");
const button = document.getElementById("find");
const missing = document.getElementById("missing");
const refused = document.getElementById("refused");
const most = Number(box.dataset.bytes);
// A mast that is put up beside its place.
const PLANNED_RADIUS_M = 3;
const NARROWEST_DEG = 5;
const cameras = [];
/** Cameras of the plan that this page was opened with, by their ids. */
const planned = new Map();
const calibrationBox = document.getElementById("calibration");
const [chosenFiles, unread, read, without] = ["input", ".wrong", "[role=status]", "button"].map((part) => calibrationBox.querySelector(part));
/** Calibration of another tool, as the service read it: its `format`, `cameras` as a venue takes them, and `not_read`. */
let calibration = null;

/** An unused camera id after the name of a file. */
function idOf(file) {
  const known = cameras.map((camera) => camera.id);
  const named = idLike(file.name.replace(/\.[a-z]+$/i, "")).slice(0, 60);
  const first = ["", "options", "site"].includes(named) ? "camera" : named;
  let id = first;
  for (let count = 2; known.includes(id); count += 1) id = `${first}-${count}`;
  return id;
}

/** A camera with a frame, and the hints about it. */
class Camera {
  constructor(file) {
    this.file = file;
    this.row = document.getElementById("found-frame").content.firstElementChild.cloneNode(true);
    this.field("camera").value = idOf(file);
    this.row.addEventListener("input", tell);
    this.row.querySelector("[data-remove]").addEventListener("click", () => {
      cameras.splice(cameras.indexOf(this), 1);
      this.row.remove();
      tell();
    });
  }

  field(name) { return this.row.querySelector(`[name="${name}"]`); }

  get id() { return this.field("camera").value; }

  /** The camera for the interface; unset hints are left out, and a camera of the plan is looked for where that puts it. */
  get wire() {
    const plan = planned.get(this.id);
    const view = number(this.field("view").value) ?? plan?.view;
    const side = this.field("side").value;
    const panorama = this.field("panorama").value;
    return {id: this.id, ...(plan ? {position: plan.position, position_radius_m: PLANNED_RADIUS_M} : {}), ...(side ? {side} : {}), ...(panorama ? {panorama} : {}), ...(view === undefined ? {} : {field_of_view_deg: view})};
  }
}

async function add(files) {
  const complaints = [];
  for (const file of files) {
    const wrong = await objection(file, await sizeOf(file).catch(() => [0, 0]), most);
    if (wrong) {
      complaints.push(wrong);
      continue;
    }
    const camera = new Camera(file);
    cameras.push(camera);
    camera.row.querySelector("[data-thumb]").append(await thumbnail(file));
    list.append(camera.row);
  }
  complain(box.querySelector(".wrong"), complaints.join(" "));
  tell();
}

/** Returns the steps that are still missing. */
function tell() {
  const open = missingOfPitch();
  for (const camera of cameras) camera.field("view").placeholder = planned.get(camera.id)?.view ?? "not known";
  if (!cameras.length) open.push("a frame");
  if (cameras.some((camera) => !camera.id || !camera.field("camera").checkValidity())) open.push("an id of each camera");
  if (new Set(cameras.map((camera) => camera.id)).size < cameras.length) open.push("cameras of different names");
  const unknown = calibration ? cameras.filter((camera) => !calibrated(camera)) : [];
  if (unknown.length) open.push(`an id of the calibration (${calibration.cameras.map((camera) => camera.id).join(", ")}) for ${unknown.map((camera) => camera.file.name).join(", ")}`);
  showMissing(open, missing, button);
}

/** The camera of the calibration that a frame is of; the only one of a file has any name. */
function calibrated(camera) {
  const [only, ...others] = calibration.cameras;
  if (!others.length && cameras.length === 1) return {...only, id: camera.id};
  return calibration.cameras.find((one) => one.id === camera.id);
}

/** Read a calibration at once, so that what is wrong with it is said here and not after a job. */
async function readCalibration(files) {
  const body = new FormData();
  for (const file of files) body.append("calibration", file);
  try {
    takeCalibration(await call("POST", `${root}/ui/new-venue/calibration`, body));
    complain(unread, "");
  } catch (problem) {
    takeCalibration(null);
    complain(unread, problem.message);
  }
}

function takeCalibration(found) {
  calibration = found;
  const words = found && [`${found.format}: ${found.cameras.map((camera) => camera.id).join(", ")}.`, ...found.not_read.map((why) => `Not read: ${why}.`)].join(" ");
  complain(read, words);
  without.hidden = !found;
  for (const part of document.querySelectorAll("[data-search]")) part.hidden = Boolean(found);
  for (const part of document.querySelectorAll("[data-calibrated]")) part.hidden = !found;
  tell();
}

/** Create the venue with the cameras of the calibration whose frames are here. */
function create() {
  const venue = {id: pitchForm.elements.id.value, name: pitchForm.elements.name.value, field: pitch.plan.field, cameras: cameras.map(calibrated)};
  return createAndCalibrate(venue, cameras.map((camera) => [camera.id, camera.file]), () => {});
}

async function find() {
  const {id} = pitchForm.elements;
  const job = await call("POST", `${root}/venues/${id.value}/find`, upload(id.value));
  location.assign(`${root}/ui/jobs/${job.id}`);
}

async function send() {
  const proposed = pitchForm.elements.id;
  button.disabled = refused.hidden = true;
  missing.textContent = "Sending the frames …";
  try {
    // Another page may have used the proposed id since, and two searches for one venue would conflict.
    if (proposed.value === proposed.defaultValue && proposed.value !== createAndCalibrate.done) proposed.value = proposed.defaultValue = (await call("GET", `${root}/ui/new-venue/free`)).id;
    await (calibration ? create() : find());
  } catch (problem) {
    complain(refused, problem.message);
    tell();
  }
}

/** The request: the site and its frames. */
function upload(id) {
  const site = {id, name: pitchForm.elements.name.value, field: pitch.plan.field, cameras: cameras.map((camera) => camera.wire)};
  const body = new FormData();
  body.append("site", new Blob([JSON.stringify(site)], {type: "application/json"}), "site.json");
  for (const camera of cameras) body.append(camera.id, camera.file);
  return body;
}

/** Begin with the pitch and the cameras of a plan. */
function takePlan() {
  const kept = location.hash === "#planned" && sessionStorage.getItem("plan");
  if (!kept) return;
  const plan = JSON.parse(kept);
  for (const [name, value] of Object.entries(plan.pitch)) pitchForm.elements[name].value = value;
  for (const {id, position, view} of plan.cameras) planned.set(id, {position, view: Math.max(NARROWEST_DEG, view)});
  document.getElementById("planned-ids").textContent = [...planned.keys()].join(", ");
  document.getElementById("from-plan").hidden = false;
}

takePlan();
onFiles(input, add);
onFiles(chosenFiles, readCalibration);
without.addEventListener("click", () => takeCalibration(null));
document.addEventListener("dragover", (event) => event.preventDefault());
document.addEventListener("drop", (event) => {
  event.preventDefault();
  const dropped = [...event.dataTransfer.files];
  const pictures = dropped.filter((file) => file.type.startsWith("image/"));
  if (pictures.length) add(pictures);
  if (dropped.length > pictures.length) readCalibration(dropped.filter((file) => !pictures.includes(file)));
});
button.addEventListener("click", send);
readForm(tell);
