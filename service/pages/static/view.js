// The stitched view of a venue: its controls, a preview with the last frames, and packages for other tools.

import {call, complain, root} from "./page.js";
import {whenShown} from "./parts.js";

const PAUSE = 250;
const OF_SIZE = ["width_px", "height_px"];
const OF_ANGLES = ["field_of_view_deg", "pan_deg", "horizon"];

class View {
  constructor(form, root, signal) {
    this.form = form;
    this.angles = root.querySelector("#view-angles");
    this.refused = root.querySelector("#view-refused");
    this.picture = root.querySelector("#view-picture");
    this.seam = root.querySelector("#view-seam");
    this.packages = root.querySelectorAll("#view-packages [data-format]");
    this.shown = "";
    this.isDrawing = false;
    form.addEventListener("input", (event) => this.turn(event.target));
    form.addEventListener("submit", (event) => this.keep(event));
    // The reset has restored the values only after the event.
    form.addEventListener("reset", () => setTimeout(() => this.changed()));
    this.angles.disabled = form.elements.projection.value === "birds-eye";
    if (!this.picture) return;
    this.seam.addEventListener("change", () => this.draw());
    // Only when it comes into view: the preview costs a stitching of frames.
    const seen = new IntersectionObserver(([{isIntersecting}]) => isIntersecting && this.draw());
    seen.observe(this.picture);
    signal.addEventListener("abort", () => { seen.disconnect(); clearTimeout(this.pause); });
  }

  /** The chosen view as the venue stores it; null: the default. */
  get chosen() {
    const numbers = [...OF_SIZE, ...OF_ANGLES].map((name) => [name, this.form.elements[name].value]);
    const view = Object.fromEntries(numbers.map(([name, value]) => [name, value === "" ? null : Number(value)]));
    return {projection: this.form.elements.projection.value, ...view, pan_deg: view.pan_deg ?? 0};
  }

  /** The chosen view as query parameters. */
  query(more) {
    const parts = Object.entries({...this.chosen, ...more}).map(([name, value]) => [name, value === null ? "auto" : value]);
    return new URLSearchParams(parts);
  }

  /** Show the view; if it changes meanwhile, show the new one next. */
  async draw() {
    const {picture} = this;
    if (!picture || this.isDrawing) return;
    this.isDrawing = true;
    picture.setAttribute("aria-busy", "true");
    for (let wanted; (wanted = `${picture.dataset.address}?${this.query({seam: this.seam.checked})}`) !== this.shown && this.form.checkValidity(); this.shown = wanted) {
      try {
        const answer = await fetch(wanted);
        if (!answer.ok) throw new Error((await answer.json()).detail);
        const view = await createImageBitmap(await answer.blob());
        picture.width = view.width;
        picture.height = view.height;
        picture.getContext("2d").drawImage(view, 0, 0);
        picture.classList.remove("waiting");
        complain(this.refused, "");
      } catch (error) {
        complain(this.refused, error.message);
      }
    }
    picture.setAttribute("aria-busy", "false");
    this.isDrawing = false;
  }

  changed() {
    this.angles.disabled = this.form.elements.projection.value === "birds-eye";
    for (const link of this.packages) link.href = `${root}/venues/${this.form.dataset.venue}/stitch?${this.query({format: link.dataset.format})}`;
    clearTimeout(this.pause);
    this.pause = setTimeout(() => this.draw(), PAUSE);
  }

  /** Keep a slider and its number in step. */
  turn({dataset: {knob}, name, value}) {
    if (knob) this.form.elements[knob].value = value;
    else if (OF_ANGLES.includes(name) && value !== "") this.form.querySelector(`[data-knob="${name}"]`).value = value;
    this.changed();
  }

  async keep(event) {
    event.preventDefault();
    const {tag} = document.querySelector("[data-tag]").dataset;
    try {
      await call("PATCH", `${root}/venues/${this.form.dataset.venue}`, {view: this.chosen}, {"If-Match": tag});
      location.reload();
    } catch (refusal) {
      complain(this.refused, refusal.message);
    }
  }
}

whenShown((root, signal) => {
  const form = root.querySelector("#view-form");
  if (form) new View(form, root, signal);
});
