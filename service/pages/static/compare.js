// Comparison of the stitched view before and after: slider, seam, and a magnifier along the seam.

import {whenShown} from "./parts.js";

const STEP = 5;
const REACH = 40;
const SHORTEST = 20;
/** Search for a line around a place of the seam: its reach, the step between places, the noise of
 * even ground, and the share by which grounds of one field differ. */
const WINDOW = 12;
const EACH = 4;
const EVEN = 8;
const ALIKE = 0.4;

/** Accessibility of the library's slider: its role for screen readers, and its keys. */
function speak(slider) {
  const value = Math.round(slider.value);
  slider.setAttribute("aria-valuenow", value);
  slider.setAttribute("aria-valuetext", `${value} % stored, ${100 - value} % new`);
}

function onKey(event, slider) {
  const steps = {ArrowLeft: -STEP, ArrowDown: -STEP, ArrowRight: STEP, ArrowUp: STEP, PageDown: -5 * STEP, PageUp: 5 * STEP, Home: -100, End: 100};
  if (!(event.key in steps)) return;
  event.preventDefault();
  slider.value = Math.min(100, Math.max(0, slider.value + steps[event.key]));
  speak(slider);
}

/** The pixels of an image, to be read. */
function pixelsOf(image) {
  const context = new OffscreenCanvas(image.naturalWidth, image.naturalHeight).getContext("2d", {willReadFrequently: true});
  context.drawImage(image, 0, 0);
  return context;
}

/** Places along the seam, in pixels of the view, from bottom to top for each pair of cameras. */
function alongTheSeam(image) {
  const {data, width, height} = pixelsOf(image).getImageData(0, 0, image.naturalWidth, image.naturalHeight);
  const chains = [];
  for (let y = height - 1; y >= 0; y -= 1) {
    for (let x = 0; x < width; x += 1) {
      if (!data[4 * (y * width + x) + 3]) continue;
      const chain = chains.find((one) => Math.hypot(one.at(-1).x - x, one.at(-1).y - y) < REACH);
      if (!chain) chains.push([{x, y}]);
      else if (chain.at(-1).y !== y) chain.push({x, y});
    }
  }
  return chains.filter((chain) => chain.length >= SHORTEST).flat();
}

/** The quantile of some values. */
function quantile(values, share) {
  return [...values].sort((one, other) => one - other)[Math.floor(share * (values.length - 1))];
}

/** How bright the pixels around a place are. */
function greysAround(context, {x, y}) {
  const side = 2 * WINDOW + 1;
  const {data} = context.getImageData(x - WINDOW, y - WINDOW, side, side);
  return Array.from({length: side * side}, (_, at) => Math.min(data[4 * at], data[4 * at + 1], data[4 * at + 2]));
}

/** The place of the seam where the new poses have moved most what looks like a line: bright, on even ground that is like
 * the ground near the cameras. */
function onALine(before, after, seam) {
  const [stored, found] = [before, after].map(pixelsOf);
  const places = seam.map(({x, y}, number) => ({x, y, number})).filter(({number}) => number % EACH === 0);
  for (const place of places) {
    const [then, greys] = [stored, found].map((context) => greysAround(context, place));
    const differences = greys.map((grey, at) => Math.abs(grey - then[at]));
    place.ground = quantile(greys, 0.5);
    place.like = ((quantile(greys, 0.97) - place.ground) * quantile(differences, 0.97)) / (EVEN + quantile(greys, 0.75) - quantile(greys, 0.25));
  }
  // Places outside the field are high up in the view.
  const below = places.filter(({y}) => y > after.naturalHeight / 2).map(({ground}) => ground);
  const usual = quantile(below.length ? below : places.map(({ground}) => ground), 0.5);
  const onTheField = places.filter(({ground}) => Math.abs(ground - usual) < ALIKE * usual);
  const best = onTheField.reduce((most, one) => (one.like > (most?.like ?? 0) ? one : most), null);
  return best ? best.number : Math.floor(seam.length / 2);
}

class Loupe {
  constructor(stage, box, before, after, seam) {
    this.stage = stage;
    this.box = box;
    this.before = before;
    this.after = after;
    this.range = box.querySelector("#along");
    this.times = box.querySelector("#times");
    this.reticle = stage.querySelector(".reticle");
    this.seam = alongTheSeam(seam);
    this.place = {x: after.naturalWidth / 2, y: after.naturalHeight / 2};
    this.range.disabled = this.seam.length === 0;
    if (this.seam.length > 1) this.range.value = Math.round((1000 * onALine(before, after, this.seam)) / (this.seam.length - 1));
    box.hidden = this.reticle.hidden = false;
    this.range.addEventListener("input", () => this.follow());
    this.times.addEventListener("change", () => this.draw());
    stage.addEventListener("pointermove", (event) => this.point(event));
    new ResizeObserver(() => this.draw()).observe(stage);
    this.follow();
  }

  follow() {
    if (this.seam.length) this.place = this.seam[Math.round((this.range.value / 1000) * (this.seam.length - 1))];
    this.draw();
  }

  point(event) {
    const rect = this.stage.getBoundingClientRect();
    const scale = this.after.naturalWidth / rect.width;
    this.place = {x: (event.clientX - rect.left) * scale, y: (event.clientY - rect.top) * scale};
    this.draw();
  }

  draw() {
    const times = Number(this.times.value);
    const {naturalWidth: wide, naturalHeight: high} = this.after;
    const first = this.box.querySelector("canvas");
    const width = Math.min(wide, first.width / times);
    const height = Math.min(high, first.height / times);
    const left = Math.min(Math.max(this.place.x - width / 2, 0), wide - width);
    const top = Math.min(Math.max(this.place.y - height / 2, 0), high - height);
    for (const [name, image] of [["before", this.before], ["after", this.after]]) {
      const context = this.box.querySelector(`#loupe-${name}`).getContext("2d");
      context.imageSmoothingEnabled = times < 4;
      context.drawImage(image, left, top, width, height, 0, 0, first.width, first.height);
    }
    const scale = this.stage.clientWidth / wide;
    for (const [side, value] of [["left", left], ["top", top], ["width", width], ["height", height]]) {
      this.reticle.style.setProperty(side, `${value * scale}px`);
    }
  }
}

function compare(stage, box) {
  const slider = stage.querySelector("img-comparison-slider");
  const [before, after, seam] = ["#before", "#after", ".seam"].map((name) => stage.querySelector(name));
  const seamSwitch = document.getElementById("seam-switch");
  const showSeam = () => { seam.hidden = !seamSwitch.checked; };
  slider.addEventListener("slide", () => speak(slider));
  slider.addEventListener("keydown", (event) => onKey(event, slider));
  seamSwitch.addEventListener("change", showSeam);
  showSeam();
  Promise.all([before, after, seam].map((image) => image.decode()))
    .then(() => new Loupe(stage, box, before, after, seam))
    .catch(() => {});
}

whenShown((root) => {
  const stage = root.querySelector(".compare");
  if (stage) compare(stage, root.querySelector(".loupe"));
});
