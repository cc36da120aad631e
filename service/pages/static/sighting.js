// A frame in which points are clicked, with shapes drawn over it.

import {pictureOf} from "./frames.js";

const SVG = "http://www.w3.org/2000/svg";
const LOUPE = {side: 200, reach: 25};

/** A new SVG element `inside` another. */
export function drawn(name, attributes, inside) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (inside) inside.append(element);
  return element;
}

/** Position of the pointer in a frame of this size, whose pixel centres are at integers. */
export function pixelAt({clientX, clientY}, canvas, [width, height]) {
  const rect = canvas.getBoundingClientRect();
  return [((clientX - rect.left) / rect.width) * width - 0.5, ((clientY - rect.top) / rect.height) * height - 0.5];
}

/** The place to which an arrow key moves the cross, `near` pixels away or with Shift 50; null for another key. */
export function stepped(cross, {key, shiftKey}, near, size) {
  const step = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]}[key];
  const by = shiftKey ? 50 : near;
  return step ? cross.map((value, axis) => Math.min(size[axis] - 1, Math.max(0, value + by * step[axis]))) : null;
}

/** The frame with its clicked points, the field projected by the pose, a loupe, and a cursor for the keyboard. */
export class Sighting {
  constructor(camera) {
    this.camera = camera;
    this.box = camera.one(".sighting");
    this.canvas = camera.one("[data-frame]");
    this.marks = camera.one("[data-marks]");
    this.loupe = camera.one("[data-loupe]");
    // Ignore the pointer until the frame is loaded.
    const onFrame = (kind, act) => this.box.addEventListener(kind, (event) => { if (this.bitmap) act(event); });
    onFrame("pointermove", (event) => this.aim(this.pixel(event)));
    onFrame("pointerleave", () => { this.loupe.hidden = true; });
    onFrame("click", (event) => camera.set(this.pixel(event)));
    onFrame("keydown", (event) => this.onKey(event));
  }

  async show(file, [width, height]) {
    this.bitmap = await pictureOf(file);
    this.canvas.width = Math.min(width, 1920);
    this.canvas.height = Math.round((height * this.canvas.width) / width);
    this.canvas.getContext("2d").drawImage(this.bitmap, 0, 0, this.canvas.width, this.canvas.height);
    this.marks.setAttribute("viewBox", `-0.5 -0.5 ${width} ${height}`);
    this.cross = [width / 2, height / 2];
    this.unit = width / 400;
  }

  get size() { return [this.bitmap.width, this.bitmap.height]; }

  /** Position of the pointer in the frame, to a tenth of a pixel. */
  pixel(event) { return pixelAt(event, this.canvas, this.size).map((value) => Math.round(10 * value) / 10); }

  aim([x, y]) {
    this.cross = [x, y];
    this.loupe.hidden = false;
    const context = this.loupe.getContext("2d");
    const {side, reach} = LOUPE;
    context.imageSmoothingEnabled = false;
    context.fillRect(0, 0, side, side);
    context.drawImage(this.bitmap, x + 0.5 - reach, y + 0.5 - reach, 2 * reach, 2 * reach, 0, 0, side, side);
    context.strokeStyle = "#fff";
    context.beginPath();
    for (const [a, b, c, d] of [[side / 2, 0, side / 2, side], [0, side / 2, side, side / 2]]) {
      context.moveTo(a, b);
      context.lineTo(c, d);
    }
    context.stroke();
    // The loupe must not cover what it shows.
    this.loupe.classList.toggle("left", x > this.bitmap.width / 2);
    this.drawCross();
  }

  onKey(event) {
    const moved = stepped(this.cross, event, 1, this.size);
    if (event.key === "Enter") this.camera.set(this.cross.map((value) => Math.round(value * 10) / 10));
    else if (moved) this.aim(moved);
    else return;
    event.preventDefault();
  }

  drawCross() {
    this.marks.querySelector(".cross")?.remove();
    const [x, y] = this.cross;
    drawn("path", {class: "cross", d: `M${x - 4 * this.unit} ${y}h${8 * this.unit}M${x} ${y - 4 * this.unit}v${8 * this.unit}`}, this.marks);
  }

  draw(points, answer) {
    this.marks.replaceChildren();
    if (answer) for (const line of answer.lines) drawn("polyline", {class: "expected", points: line.map((place) => place.join(",")).join(" ")}, this.marks);
    for (const {name, pixel} of points) {
      const at = answer ? answer.asked.findIndex((point) => point.name === name) : -1;
      const expected = at >= 0 ? answer.expected[at] : null;
      const doubted = at >= 0 && answer.result && answer.result.points[at].doubted;
      if (expected) drawn("line", {class: "residual", x1: pixel[0], y1: pixel[1], x2: expected[0], y2: expected[1]}, this.marks);
      const mark = drawn("circle", {class: doubted ? "click doubted" : "click", cx: pixel[0], cy: pixel[1], r: 2 * this.unit}, this.marks);
      drawn("title", {}, mark).textContent = name;
    }
  }
}
