// The way to a first calibration. What is gathered stays here until the venue is created.

import {call, Refused, signed} from "./page.js";
import {objection, sizeOf} from "./frames.js";
import {drawn, Sighting} from "./sighting.js";

const FEWEST = 4;
const PAUSE = 250;
const most = Number(document.getElementById("limits").dataset.bytes);
const pitchForm = document.getElementById("pitch");
const createButton = document.getElementById("create");
const missing = document.getElementById("missing");
const cameras = [];
let plan = null;

function complain(place, text) {
  place.textContent = text || "";
  place.hidden = !text;
}

function number(text) {
  return text.trim() === "" ? undefined : Number(text.replace(",", "."));
}

function later(act) {
  let timer = 0;
  return () => {
    clearTimeout(timer);
    timer = setTimeout(act, PAUSE);
  };
}

// The pitch

function fieldAsTyped() {
  const value = (name) => number(pitchForm.elements[name].value);
  const field = {template: pitchForm.elements.template.value};
  for (const name of ["length_m", "width_m", "line_width_m"]) if (value(name) !== undefined) field[name] = value(name);
  const height = value("ridge_height");
  if (height) {
    const usual = plan ? plan.field.length_m - plan.field.width_m : 37;
    const half = (value("ridge_length") ?? usual) / 2;
    field.ridge = [[-half, 0, height], [half, 0, height]];
  }
  return field;
}

async function readPitch() {
  const wrong = pitchForm.querySelector(".wrong");
  try {
    plan = await call("POST", "/ui/new-venue/plan", fieldAsTyped());
    complain(wrong, "");
  } catch (refused) {
    plan = null;
    complain(wrong, refused.message);
    return tell();
  }
  for (const name of ["length_m", "width_m", "line_width_m"]) pitchForm.elements[name].placeholder = plan.field[name];
  drawPlan(document.getElementById("plan"));
  for (const camera of cameras) camera.offerPoints();
  return tell();
}

/** The pitch from above, y up; returns what follows the pitch in it. */
function drawPlan(svg) {
  const {length_m: length, width_m: width} = plan.field;
  svg.replaceChildren();
  svg.setAttribute("viewBox", `${-length / 2 - 4} ${-width / 2 - 4} ${length + 8} ${width + 8}`);
  for (const line of plan.lines) drawn("polyline", {points: line.map(([x, y]) => `${x},${-y}`).join(" ")}, svg);
}

// A camera

class Camera {
  constructor(id) {
    this.box = document.getElementById("camera").content.firstElementChild.cloneNode(true);
    this.points = [];
    this.result = null;
    this.sigma = null;
    this.asking = false;
    this.askAgain = false;
    const way = `way-${cameras.length}-${Date.now()}`;
    for (const radio of this.all("[data-way]")) radio.name = way;
    document.getElementById("cameras").append(this.box);
    this.field("id").value = id;
    this.listen();
    this.rename();
  }

  one(selector) { return this.box.querySelector(selector); }

  all(selector) { return [...this.box.querySelectorAll(selector)]; }

  field(name) { return this.one(`[name="${name}"]`); }

  get id() { return this.field("id").value; }

  listen() {
    this.field("id").addEventListener("input", () => this.rename());
    this.field("frame").addEventListener("change", () => this.takeFrame());
    for (const radio of this.all("[data-way]")) {
      radio.addEventListener("change", () => { this.one("[data-photos]").hidden = radio.value !== "photos"; });
    }
    this.one("[data-solve]").addEventListener("click", () => this.solve());
    this.one("[data-remove]").addEventListener("click", () => {
      cameras.splice(cameras.indexOf(this), 1);
      this.box.remove();
      tell();
    });
    const askLater = later(() => this.ask());
    for (const name of ["model", "fx", "fy", "cx", "cy", "distortion"]) {
      this.field(name).addEventListener("input", () => {
        // What photos say of their lens does not hold for one that was typed in.
        this.sigma = null;
        askLater();
      });
    }
    this.sighting = new Sighting(this);
    this.one("[data-point]").addEventListener("change", () => this.choose(this.chosen));
  }

  rename() {
    this.one("[data-name]").textContent = this.id;
    tell();
  }

  async takeFrame() {
    const [file] = this.field("frame").files;
    if (!file) return;
    let size;
    let wrong;
    try {
      size = await sizeOf(file);
      wrong = await objection(file, size, most);
    } catch {
      wrong = `${file.name} cannot be read as a picture.`;
    }
    complain(this.one(".wrong"), wrong);
    if (wrong) return;
    this.file = file;
    this.size = size;
    for (const [name, value] of [["cx", (size[0] - 1) / 2], ["cy", (size[1] - 1) / 2]]) {
      if (!this.field(name).value) this.field(name).value = value;
    }
    this.one("[data-lens]").hidden = this.one("[data-clicking]").hidden = false;
    this.offerPoints();
    await this.sighting.show(file, size);
    this.ask();
  }

  // Its lens

  get intrinsics() {
    const [fx, fy, cx, cy] = ["fx", "fy", "cx", "cy"].map((name) => number(this.field(name).value));
    if ([fx, cx, cy].some((value) => !Number.isFinite(value))) return null;
    const distortion = this.field("distortion").value.split(/[\s,;]+/).filter(Boolean).map(Number);
    return {model: this.field("model").value, matrix: [[fx, 0, cx], [0, fy ?? fx, cy], [0, 0, 1]], distortion, sigma: this.sigma};
  }

  set intrinsics({model, matrix, distortion, sigma}) {
    this.sigma = sigma;
    const values = {model, fx: matrix[0][0], fy: matrix[1][1], cx: matrix[0][2], cy: matrix[1][2], distortion: distortion.join(", ")};
    for (const [name, value] of Object.entries(values)) this.field(name).value = value;
  }

  async solve() {
    const told = this.one("[data-solving]");
    const body = new FormData();
    for (const photo of this.field("photos").files) body.append("photos", photo);
    const board = {columns: Number(this.field("columns").value), rows: Number(this.field("rows").value), square_m: Number(this.field("square").value) / 1000};
    body.append("options", JSON.stringify({board, model: this.field("model").value}));
    told.textContent = "Sending the photos …";
    try {
      const job = await ended(await call("POST", "/intrinsics", body), (now) => { told.textContent = now; });
      if (!job.result) throw new Refused({detail: job.error ? job.error.detail : `The job was ${job.status}.`}, 0);
      this.intrinsics = job.result.intrinsics;
      told.textContent = [`Found: ${job.result.rms_px.toFixed(2)} px rms.`, ...job.result.warnings].join(" ");
      this.ask();
    } catch (refused) {
      told.textContent = refused.message;
    }
  }

  // Its clicks

  get chosen() { return this.one("[data-point]").value; }

  offerPoints() {
    if (!plan) return;
    const select = this.one("[data-point]");
    const before = select.value;
    select.replaceChildren(...Object.keys(plan.points).sort().map((name) => new Option(name)));
    if (before in plan.points) select.value = before;
    this.points = this.points.filter((point) => point.name in plan.points);
    this.drawPlan();
    this.ask();
  }

  drawPlan() {
    const svg = this.one("[data-plan]");
    drawPlan(svg);
    for (const [name, [x, y]] of Object.entries(plan.points)) {
      const set = this.points.some((point) => point.name === name);
      const dot = drawn("circle", {cx: x, cy: -y, r: name === this.chosen ? 2.2 : 1.5, class: `${set ? "set" : ""} ${name === this.chosen ? "chosen" : ""}`}, svg);
      drawn("title", {}, dot).textContent = name;
      dot.addEventListener("click", () => this.choose(name));
    }
  }

  choose(name) {
    this.one("[data-point]").value = name;
    this.drawPlan();
  }

  set(pixel) {
    const {chosen} = this;
    this.points = [...this.points.filter((point) => point.name !== chosen), {name: chosen, pixel}];
    this.drawPlan();
    this.drawPoints();
    this.ask();
  }

  drop(name) {
    this.points = this.points.filter((point) => point.name !== name);
    this.drawPlan();
    this.drawPoints();
    this.ask();
  }

  /** Ask for the pose; of several changes while one is being computed the last is asked about. */
  async ask() {
    this.result = null;
    tell();
    const {intrinsics} = this;
    if (!this.file || !plan || !intrinsics || this.points.length < FEWEST) {
      this.answer = null;
      const need = intrinsics ? `${Math.max(0, FEWEST - this.points.length)} more points.` : "The focal length is missing.";
      this.one("[data-verdict]").textContent = need;
      return this.drawPoints();
    }
    if (this.asking) {
      this.askAgain = true;
      return null;
    }
    this.asking = true;
    this.one("[data-verdict]").textContent = "…";
    const asked = [...this.points];
    try {
      const points = asked.map(({name, pixel}) => ({world: name, pixel}));
      const answer = await call("POST", "/ui/new-venue/pose", {field: plan.field, id: this.id || "camera", image_size: this.size, intrinsics, points});
      this.take(answer, asked);
    } catch (refused) {
      if (refused.status === 503) this.askAgain = true;
      this.one("[data-verdict]").textContent = refused.message;
    }
    this.asking = false;
    if (this.askAgain) {
      this.askAgain = false;
      setTimeout(() => this.ask(), PAUSE);
    }
    return null;
  }

  take(answer, asked) {
    this.answer = {...answer, asked};
    const {result, error} = answer;
    this.result = result && result.accepted ? result : null;
    const verdict = this.one("[data-verdict]");
    verdict.className = this.result ? "fine" : "wrong";
    if (!result) verdict.textContent = error.detail;
    else {
      const lens = result.lens ? ` The lens was corrected: ${result.lens.free.join(", ")}.` : "";
      verdict.textContent = result.accepted
        ? `Good: ${result.rms_px.toFixed(1)} px rms, ${result.pose.position[2].toFixed(1)} m above the pitch.${lens}`
        : result.rejected_because;
    }
    this.drawPoints();
    tell();
  }

  drawPoints() {
    this.sighting.draw(this.points, this.answer);
    const rows = this.points.map(({name}) => {
      const row = document.createElement("tr");
      const at = this.answer ? this.answer.asked.findIndex((point) => point.name === name) : -1;
      const point = at >= 0 && this.answer.result ? this.answer.result.points[at] : null;
      const remove = document.createElement("button");
      remove.type = "button";
      remove.className = "quiet small-button";
      remove.textContent = "Remove";
      remove.setAttribute("aria-label", `Remove ${name}`);
      remove.addEventListener("click", () => this.drop(name));
      for (const content of [name, residual(point), remove]) row.insertCell().append(content);
      row.cells[1].className = "num";
      row.classList.toggle("doubted", Boolean(point && point.doubted));
      return row;
    });
    this.one(".clicks tbody").replaceChildren(...rows);
  }

  /** The camera as the interface takes it. */
  get wire() {
    const {intrinsics, pose} = this.result;
    return {id: this.id, image_size: this.size, intrinsics, pose: {rotation: pose.rotation, position: pose.position}};
  }
}

function residual(point) {
  if (!point) return "–";
  const doubt = point.looks_like ? `, rather ${point.looks_like}` : point.doubted ? ", not it" : "";
  return point.residual_px === null ? "out of sight" : `${point.residual_px.toFixed(1)} px${doubt}`;
}

// The end

/** A job once it has ended; tells meanwhile how far it is. */
function ended(job, told) {
  return new Promise((resolve, reject) => {
    const events = new EventSource(job.links.events);
    events.addEventListener("progress", (event) => {
      const {progress, status} = JSON.parse(event.data);
      told(progress ? `${progress.stage}, ${Math.round(100 * progress.fraction)} %` : status);
    });
    events.addEventListener("end", (event) => { events.close(); resolve(JSON.parse(event.data)); });
    events.addEventListener("error", () => {
      if (events.readyState === EventSource.CLOSED) reject(new Refused({detail: "The service cannot be reached."}, 0));
    });
  });
}

/** What is still to be done. */
function tell() {
  const open = [];
  const {id} = pitchForm.elements;
  if (!id.value || !id.checkValidity()) open.push("an id of small letters, digits, - and _");
  if (!plan) open.push("a pitch");
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
    const venue = {id, name: pitchForm.elements.name.value, field: plan.field, cameras: cameras.map((camera) => camera.wire)};
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

pitchForm.addEventListener("input", later(readPitch));
pitchForm.addEventListener("submit", (event) => event.preventDefault());
document.getElementById("add").addEventListener("click", () => {
  cameras.push(new Camera(["left", "right", "middle"][cameras.length] || `camera-${cameras.length + 1}`));
  tell();
});
createButton.addEventListener("click", create);
cameras.push(new Camera("left"));
readPitch();
