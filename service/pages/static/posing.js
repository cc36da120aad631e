// Cameras whose first pose is found from points of the pitch that are clicked in a frame.

import {call, complain, Refused, root} from "./page.js";
import {objection, removeButton, sizeOf} from "./frames.js";
import {drawn, Sighting} from "./sighting.js";
import {drawPlan, later, number} from "./steps.js";

const FEWEST = 4;
const PAUSE = 250;
// Sizes as shares of the length of the pitch.
const LARGEST_POINT = 0.014;
const SMALLEST_POINT = 0.006;
const most = Number(document.getElementById("limits").dataset.bytes);

/** Shared state of the cameras of a page: the plan of their pitch, and the callback after a change. */
export const common = {plan: null, cameras: [], tell() {}};

/** Radius of the points of the plan: as large as possible without touching, but not invisible. */
function pointRadius() {
  const places = Object.values(common.plan.points);
  let nearest = Infinity;
  places.forEach(([x, y], number) => {
    for (const [otherX, otherY] of places.slice(number + 1)) {
      const apart = Math.hypot(x - otherX, y - otherY);
      if (apart > 0) nearest = Math.min(nearest, apart);
    }
  });
  return Math.min(LARGEST_POINT * common.plan.field.length_m, Math.max(SMALLEST_POINT * common.plan.field.length_m, 0.4 * nearest));
}

// A camera

export class Camera {
  constructor(id) {
    this.box = document.getElementById("camera").content.firstElementChild.cloneNode(true);
    this.points = [];
    this.result = null;
    this.sigma = null;
    this.asking = false;
    this.askAgain = false;
    const way = `way-${common.cameras.length}-${Date.now()}`;
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
      common.cameras.splice(common.cameras.indexOf(this), 1);
      this.box.remove();
      common.tell();
    });
    const askLater = later(() => this.ask());
    for (const name of ["model", "fx", "fy", "cx", "cy", "distortion"]) {
      this.field(name).addEventListener("input", () => {
        // The uncertainty from photos does not hold for a lens that is typed in.
        this.sigma = null;
        askLater();
      });
    }
    this.sighting = new Sighting(this);
    this.one("[data-point]").addEventListener("change", () => this.choose(this.chosen));
    const [chart, under] = [this.one("[data-plan]"), this.one("[data-under]")];
    chart.addEventListener("click", (event) => this.choose(this.nearest(event)));
    chart.addEventListener("pointermove", (event) => { under.textContent = this.nearest(event); });
    chart.addEventListener("pointerleave", () => { under.textContent = ""; });
  }

  rename() {
    this.one("[data-name]").textContent = this.id;
    common.tell();
  }

  async takeFrame() {
    const [file] = this.field("frame").files;
    if (!file) return;
    let size;
    let wrong;
    try {
      size = await sizeOf(file);
      wrong = await objection(file, this.expectedSize || size, most);
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
    this.one("[data-lens]").hidden = false;
    this.offerPoints();
    await this.sighting.show(file, size);
    // Only after the frame has its size: an earlier click would be at another place.
    this.one("[data-clicking]").hidden = false;
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
      const job = await ended(await call("POST", `${root}/intrinsics`, body), (now) => { told.textContent = now; });
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
    if (!common.plan) return;
    const select = this.one("[data-point]");
    const before = select.value;
    select.replaceChildren(...Object.keys(common.plan.points).sort().map((name) => new Option(name)));
    if (before in common.plan.points) select.value = before;
    this.points = this.points.filter((point) => point.name in common.plan.points);
    this.drawPlan();
    this.ask();
  }

  drawPlan() {
    const svg = this.one("[data-plan]");
    drawPlan(svg, common.plan);
    const radius = pointRadius();
    for (const [name, [x, y]] of Object.entries(common.plan.points)) {
      const set = this.points.some((point) => point.name === name);
      const dot = drawn("circle", {cx: x, cy: -y, r: (name === this.chosen ? 1.25 : 1) * radius, class: `${set ? "set" : ""} ${name === this.chosen ? "chosen" : ""}`}, svg);
      drawn("title", {}, dot).textContent = name;
    }
  }

  /** The point of the plan nearest to the pointer. */
  nearest(event) {
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(this.one("[data-plan]").getScreenCTM().inverse());
    const far = ([, [x, y]]) => Math.hypot(x - at.x, -y - at.y);
    return Object.entries(common.plan.points).reduce((best, one) => (far(one) < far(best) ? one : best))[0];
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

  /** Request the pose; while one is being computed, only the last change is requested next. */
  async ask() {
    this.result = null;
    common.tell();
    const {intrinsics} = this;
    if (!this.file || !common.plan || !intrinsics || this.points.length < FEWEST) {
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
      const answer = await call("POST", `${root}/ui/new-venue/pose`, {field: common.plan.field, id: this.id || "camera", image_size: this.size, intrinsics, points});
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
    const doubted = result ? asked.filter((_, number) => result.points[number].doubted).map(({name}) => name) : [];
    verdict.className = !this.result ? "wrong" : doubted.length ? "note" : "fine";
    if (!result) verdict.textContent = error.detail;
    else {
      const lens = result.lens ? ` The lens was corrected: ${result.lens.free.join(", ")}.` : "";
      const how = doubted.length ? `The others agree, but not ${doubted.join(", ")}: click it again, or remove it.` : "Good:";
      verdict.textContent = result.accepted
        ? `${how} ${result.rms_px.toFixed(1)} px rms, ${result.pose.position[2].toFixed(1)} m above the pitch.${lens}`
        : result.rejected_because;
    }
    this.drawPoints();
    common.tell();
  }

  drawPoints() {
    this.sighting.draw(this.points, this.answer);
    const rows = this.points.map(({name}) => {
      const row = document.createElement("tr");
      const at = this.answer ? this.answer.asked.findIndex((point) => point.name === name) : -1;
      const point = at >= 0 && this.answer.result ? this.answer.result.points[at] : null;
      const remove = removeButton(name, () => this.drop(name));
      for (const content of [name, residual(point), remove]) row.insertCell().append(content);
      row.cells[1].className = "num";
      row.classList.toggle("doubted", Boolean(point && point.doubted));
      return row;
    });
    this.one(".clicks tbody").replaceChildren(...rows);
  }

  /** The camera for the interface. */
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

/** Wait for the end of a job, with reports of its progress. */
function ended(job, told) {
  return new Promise((resolve, reject) => {
    const events = new EventSource(`${root}${job.links.events}`);
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
