// Ignored areas of each camera's frame: drawn corner by corner, saved with the venue.

import {pictureOf, removeButton} from "./frames.js";
import {call, root} from "./page.js";
import {drawn, pixelAt, stepped} from "./sighting.js";

const WIDEST = 1920;
/** Distance from the first corner, in screen pixels, within which a click closes an area. */
const CLOSING = 12;
const FEWEST = 3;
const venue = document.getElementById("ignored").dataset.venue;
const save = document.getElementById("save");
const saved = document.getElementById("saved");

class Areas {
  constructor(box) {
    this.box = box;
    this.camera = box.dataset.camera;
    this.size = [Number(box.dataset.width), Number(box.dataset.height)];
    this.areas = JSON.parse(box.dataset.areas);
    this.open = [];
    this.cross = this.size.map((side) => side / 2);
    this.sighting = box.querySelector(".sighting");
    this.canvas = box.querySelector("canvas");
    this.svg = box.querySelector("svg");
    this.svg.setAttribute("viewBox", `-0.5 -0.5 ${this.size[0]} ${this.size[1]}`);
    this.canvas.width = Math.min(this.size[0], WIDEST);
    this.canvas.height = Math.round((this.size[1] * this.canvas.width) / this.size[0]);
    this.sighting.addEventListener("click", (event) => this.set(pixelAt(event, this.canvas, this.size)));
    this.sighting.addEventListener("keydown", (event) => this.onKey(event));
    box.querySelector("input[type=file]").addEventListener("change", (event) => this.show(event.target.files[0]));
    if (box.dataset.address) this.fetch(box.dataset.address);
    this.draw();
  }

  async fetch(address) {
    const answer = await fetch(address).catch(() => null);
    if (answer && answer.ok) await this.show(await answer.blob());
    else this.say("The frame of the last result is no longer kept: choose a file.");
  }

  async show(file) {
    if (!file) return;
    try {
      const picture = await pictureOf(file);
      const alike = Math.abs(picture.width / picture.height - this.size[0] / this.size[1]) < 0.01;
      this.say(alike ? "" : `This picture has ${picture.width} × ${picture.height} pixels, the frames of this camera are of another shape.`);
      this.canvas.getContext("2d").drawImage(picture, 0, 0, this.canvas.width, this.canvas.height);
    } catch {
      this.say("This file cannot be read as a picture.");
    }
  }

  say(words) { this.box.querySelector("[data-said]").textContent = words; }

  set(pixel) {
    const scale = this.canvas.getBoundingClientRect().width / this.size[0];
    const [first] = this.open;
    if (this.open.length >= FEWEST && Math.hypot(pixel[0] - first[0], pixel[1] - first[1]) * scale < CLOSING) return this.close();
    this.open.push(pixel.map((value, axis) => Math.round(Math.min(this.size[axis] - 1, Math.max(0, value)))));
    return this.draw();
  }

  close() {
    if (this.open.length < FEWEST) return this.say(`An area has at least ${FEWEST} corners.`);
    this.areas.push(this.open);
    this.open = [];
    this.say("");
    return this.changed();
  }

  changed() {
    save.disabled = false;
    saved.textContent = "Not saved yet.";
    this.draw();
  }

  onKey(event) {
    const moved = stepped(this.cross, event, 5, this.size);
    if (event.key === " ") this.set(this.cross);
    else if (event.key === "Enter") this.close();
    else if (event.key === "Backspace") this.open.pop();
    else if (event.key === "Escape") this.open = [];
    else if (moved) this.cross = moved;
    else return;
    event.preventDefault();
    this.draw();
  }

  draw() {
    this.svg.replaceChildren();
    for (const area of this.areas) drawn("polygon", {class: "area", points: area.map((corner) => corner.join(",")).join(" ")}, this.svg);
    if (this.open.length) drawn("polyline", {class: "area open", points: this.open.map((corner) => corner.join(",")).join(" ")}, this.svg);
    const unit = this.size[0] / 250;
    for (const [x, y] of this.open) drawn("circle", {class: "corner", cx: x, cy: y, r: unit}, this.svg);
    const [x, y] = this.cross;
    drawn("path", {class: "cross", d: `M${x - 3 * unit} ${y}h${6 * unit}M${x} ${y - 3 * unit}v${6 * unit}`}, this.svg);
    this.list();
  }

  list() {
    const items = this.areas.map((area, number) => {
      const item = document.createElement("li");
      const remove = removeButton(`area ${number + 1} of camera ${this.camera}`, () => {
        this.areas = this.areas.filter((one) => one !== area);
        this.changed();
      });
      item.append(`${area.length} corners `, remove);
      return item;
    });
    this.box.querySelector(".areas").replaceChildren(...items);
  }
}

const cameras = [...document.querySelectorAll("[data-camera]")].map((box) => new Areas(box));

save.addEventListener("click", async () => {
  save.disabled = true;
  const changes = Object.fromEntries(cameras.map((one) => [one.camera, {ignore: one.areas}]));
  try {
    await call("PATCH", `${root}/venues/${venue}`, {cameras: changes});
    saved.textContent = "Saved. The next calibration ignores these areas.";
  } catch (refused) {
    save.disabled = false;
    saved.textContent = refused.message;
  }
});
