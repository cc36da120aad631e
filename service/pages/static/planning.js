// A plan of cameras before they are mounted: the form, and the answer as tables and maps.

import {call, complain, root} from "./page.js";
import {pitch, pitchForm, readForm} from "./pitch.js";
import {drawn} from "./sighting.js";
import {number, showMissing} from "./steps.js";

const list = document.querySelector(".planned");
const makeButton = document.getElementById("make");
const missing = document.getElementById("missing");
const refused = document.getElementById("refused");
const result = document.getElementById("planned");
const NUMBERS = ["x", "y", "z", "look_x", "look_y", "view"];
// Two cameras on one mast beside the halfway line, in parts of the width of the field, in a small hall `least_m` up and
// away: on a football pitch 12 m up and 15 m away, as in the first row of the rules of thumb. They look as far to the
// side as `aside` of the distance.
const MAST = {away: 0.22, height: 0.176, least_m: 5, aim: -0.147, aside: 0.603, view: 75};
const cameras = [];
let answer = null;

const cm = (metres) => `${(100 * metres).toFixed(1)} cm`;
const percent = (share) => `${(100 * share).toFixed(share > 0.99 && share < 1 ? 1 : 0)} %`;
const change = ({before_m: before, after_m: after}) => `${after < before ? "−" : "+"}${cm(Math.abs(after - before))}`;

/** A camera as it is typed in. `side`: -1 looks to the left half, 1 to the right half. */
class PlannedCamera {
  constructor(id, side) {
    this.row = document.getElementById("planned-camera").content.firstElementChild.cloneNode(true);
    this.side = side;
    this.isTouched = false;
    this.field("id").value = id;
    this.row.addEventListener("input", () => {
      this.isTouched = true;
      tell();
    });
    this.row.querySelector("[data-remove]").addEventListener("click", () => {
      cameras.splice(cameras.indexOf(this), 1);
      this.row.remove();
      tell();
    });
    list.append(this.row);
    this.propose();
  }

  field(name) { return this.row.querySelector(`[name="${name}"]`); }

  get id() { return this.field("id").value; }

  number(name) { return number(this.field(name).value); }

  /** Put the camera on the mast, unless somebody has placed it. */
  propose() {
    if (this.isTouched || !pitch.plan) return;
    const width = pitch.plan.field.width_m;
    const [x, y, aim] = [0.5 * this.side, -width / 2 - Math.max(MAST.least_m, MAST.away * width), MAST.aim * width];
    const place = {x, y, z: Math.max(MAST.least_m, MAST.height * width), look_x: x + this.side * MAST.aside * (aim - y), look_y: aim, view: MAST.view};
    for (const name of NUMBERS) this.field(name).value = Math.round(10 * place[name]) / 10;
  }

  get isComplete() {
    return this.id && this.field("id").checkValidity() && NUMBERS.every((name) => Number.isFinite(this.number(name)));
  }

  /** The camera for the interface. */
  get wire() {
    const [x, y, z, lookX, lookY, view] = NUMBERS.map((name) => this.number(name));
    const size = this.field("size").value.split("x").map(Number);
    return {id: this.id, image_size: size, position: [x, y, z], look_at: [lookX, lookY], field_of_view_deg: view};
  }
}

/** Show which steps are missing, and the cameras on the pitch. */
function tell() {
  const open = [];
  if (!pitch.plan) open.push("a pitch");
  if (!cameras.length) open.push("a camera");
  if (!cameras.every((camera) => camera.isComplete)) open.push("an id and all numbers of each camera");
  if (new Set(cameras.map((camera) => camera.id)).size < cameras.length) open.push("cameras of different names");
  showMissing(open, missing, makeButton);
  drawCameras();
}

/** Draw where each camera stands and what it has in view to the left and right, on the pitch from above. */
function drawCameras() {
  const svg = document.getElementById("plan");
  svg.querySelector("g")?.remove();
  if (!pitch.plan) return;
  const {length_m: length, width_m: width} = pitch.plan.field;
  const placed = cameras.filter((camera) => camera.isComplete).map((camera) => camera.wire);
  const margin = 0.07 * length;
  const [[left, right], [bottom, top]] = [length, width].map((extent, axis) => {
    const all = [-extent / 2, extent / 2, ...placed.map((camera) => camera.position[axis])];
    return [Math.min(...all) - margin, Math.max(...all) + margin];
  });
  svg.setAttribute("viewBox", `${left} ${-top} ${right - left} ${top - bottom}`);
  const group = drawn("g", {}, svg);
  for (const {id, position: [x, y], look_at: [lookX, lookY], field_of_view_deg: view} of placed) {
    const ahead = Math.atan2(lookY - y, lookX - x);
    const edges = [-1, 1].map((hand) => ahead + (hand * view * Math.PI) / 360).map((angle) => `${x + length * Math.cos(angle)},${-(y + length * Math.sin(angle))}`);
    drawn("polygon", {class: "in-view", points: [`${x},${-y}`, ...edges].join(" ")}, group);
    drawn("title", {}, drawn("circle", {cx: x, cy: -y, r: 0.012 * length}, group)).textContent = id;
  }
}

function changed() {
  for (const camera of cameras) camera.propose();
  tell();
}

async function make() {
  makeButton.disabled = refused.hidden = true;
  missing.textContent = "Planning …";
  const asked = new URLSearchParams({lines: document.getElementById("lines").value, hidden: (number(document.getElementById("covered").value) ?? 0) / 100});
  try {
    answer = await call("POST", `${root}/plan?${asked}`, {field: pitch.plan.field, cameras: cameras.map((camera) => camera.wire)});
    await show();
  } catch (problem) {
    complain(refused, problem.message);
  }
  tell();
}

async function show() {
  const {plan} = answer;
  const poor = plan.cameras.filter((camera) => !camera.calibratable).map((camera) => camera.id);
  const head = document.getElementById("planned-head");
  head.textContent = poor.length ? `Cannot be calibrated: ${poor.join(", ")}` : "All cameras can be calibrated";
  head.className = poor.length ? "wrong" : "fine";
  write("warnings", plan.warnings.map(warning));
  document.getElementById("place").textContent = plan.place_m ? `± ${cm(plan.place_m.median)}` : "–";
  document.getElementById("worst").textContent = plan.place_m ? `± ${cm(plan.place_m.worst)}` : "–";
  const once = 1 - (plan.covered[0] ?? 0);
  document.getElementById("seen").textContent = percent(once);
  document.getElementById("twice").textContent = `${percent(Math.max(0, once - (plan.covered[1] ?? 0)))} by two cameras or more`;
  write("cameras-planned", plan.cameras.map(cameraRow));
  write("pairs-planned", plan.pairs.map(pairRow));
  document.getElementById("pairs").hidden = !plan.pairs.length;
  result.hidden = false;
  await showMap();
  result.focus();
}

function write(id, parts) {
  document.getElementById(id).replaceChildren(...parts);
}

function warning({cameras: whose, detail}) {
  const item = document.createElement("li");
  item.className = "note";
  item.textContent = whose.length ? `${whose.join(", ")}: ${detail}.` : `${detail[0].toUpperCase()}${detail.slice(1)}.`;
  return item;
}

function cameraRow(camera) {
  const {px_per_metre: pixels, place_m: place, sigma, one_metre_higher: higher} = camera;
  const decisive = camera.decisive_markings.slice(0, 3).map(({marking, without}) => `${marking} (${change(without)})`);
  return row(camera.id, [
    ["Sees of the field", percent(camera.share_of_field)],
    ["Pixels per metre", pixels ? `${pixels.median.toFixed(0)}, least ${pixels.worst.toFixed(0)}` : "–"],
    ["Pose", `± ${sigma.rotation_deg.toFixed(3)}° ± ${cm(sigma.position_m)}`],
    ["A player's place", place ? `± ${cm(place.median)}, worst ${cm(place.worst)}` : "–"],
    ["One metre higher", higher ? change(higher) : "–"],
    ["Worse without", decisive.join(", ") || "–"],
  ]);
}

function pairRow({cameras: both, overlap_m2: overlap, stitch_m: stitch, five_degrees_more_m: more}) {
  return row(both.join(" + "), [
    ["Overlap", `${overlap.toFixed(0)} m²`],
    ["Stitch", `± ${cm(stitch)}`],
    ["5° more overlap", more === null ? "–" : `± ${cm(more)}`],
  ]);
}

/** A row of a table: what it is about, and its cells with their labels for narrow screens. */
function row(name, cells) {
  const made = document.createElement("tr");
  const head = Object.assign(document.createElement("th"), {scope: "row", textContent: name});
  made.append(head);
  for (const [label, text] of cells) {
    const cell = made.insertCell();
    cell.dataset.label = label;
    cell.textContent = text;
    cell.className = label === "Worse without" ? "wraps" : "num";
  }
  return made;
}

async function showMap() {
  const canvas = document.getElementById("map");
  const chosen = document.querySelector("[name=map]:checked");
  const bytes = Uint8Array.from(atob(answer.pictures[chosen.value]), (letter) => letter.charCodeAt(0));
  const picture = await createImageBitmap(new Blob([bytes], {type: "image/png"}));
  [canvas.width, canvas.height] = [picture.width, picture.height];
  canvas.getContext("2d").drawImage(picture, 0, 0);
  picture.close();
  canvas.setAttribute("aria-label", `The field from above: ${chosen.parentElement.textContent.trim()}`);
}

/** Take the pitch and the cameras to the page of a new venue. */
function carry() {
  const {template, length_m: length, width_m: width, line_width_m: line} = pitch.plan.field;
  const kept = {pitch: {template, length_m: length, width_m: width, line_width_m: line}, cameras: answer.plan.cameras.map(({id, position, field_of_view_deg: view}) => ({id, position, view}))};
  sessionStorage.setItem("plan", JSON.stringify(kept));
  location.assign(`${root}/ui/new-venue#planned`);
}

for (const [id, side] of [["left", -1], ["right", 1]]) cameras.push(new PlannedCamera(id, side));
document.getElementById("add").addEventListener("click", () => {
  const taken = cameras.map((camera) => camera.id);
  let count = cameras.length + 1;
  while (taken.includes(`camera-${count}`)) count += 1;
  cameras.push(new PlannedCamera(`camera-${count}`, 0));
  tell();
});
for (const radio of document.querySelectorAll("[name=map]")) radio.addEventListener("change", showMap);
document.getElementById("carry")?.addEventListener("click", carry);
makeButton.addEventListener("click", make);
readForm(changed);
