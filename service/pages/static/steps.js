// Shared code of the pages that describe a venue step by step.

import {call, root} from "./page.js";
import {drawn} from "./sighting.js";

const PAUSE = 250;

/** Name the steps that are still missing; without any, the button can be pressed. */
export function showMissing(steps, place, button) {
  place.textContent = steps.length ? `Still missing: ${steps.join("; ")}.` : "";
  button.disabled = steps.length > 0;
}

export function number(text) {
  return text.trim() === "" ? undefined : Number(text.replace(",", "."));
}

/** Create a venue with first poses, then calibrate it with `frames`, a file of each camera; `told`: that these are sent. */
export async function createAndCalibrate(venue, frames, told) {
  // A venue that this page has created is there when its frames are sent again.
  await call("PUT", `${root}/venues/${venue.id}`, venue, createAndCalibrate.done === venue.id ? {} : {"If-None-Match": "*"});
  createAndCalibrate.done = venue.id;
  const body = new FormData();
  for (const [camera, file] of frames) body.append(camera, file);
  told();
  const job = await call("POST", `${root}/venues/${venue.id}/calibrate`, body);
  location.assign(`${root}/ui/jobs/${job.id}`);
}

// Latin letters that Unicode does not decompose, as in `id_like` of the service.
const SPELT_OUT = {"æ": "ae", "đ": "d", "ð": "d", "ı": "i", "ł": "l", "ø": "o", "œ": "oe", "ß": "ss", "þ": "th"};

/** The id closest to a name: "Süd 01" becomes "sud-01"; empty if no character can be kept. */
export function idLike(name) {
  const spelt = [...name.toLowerCase()].map((letter) => SPELT_OUT[letter] ?? letter).join("");
  const plain = spelt.normalize("NFKD").replace(/\p{Mn}/gu, "");
  return plain.replace(/[^a-z0-9_-]+/g, "-").replace(/^[-_]+|[-_]+$/g, "").slice(0, 64);
}

export function later(act) {
  let timer = 0;
  return () => {
    clearTimeout(timer);
    timer = setTimeout(act, PAUSE);
  };
}

/** The pitch from above, y up, labelled with the words in the names of points. */
export function drawPlan(svg, plan) {
  const {length_m: length, width_m: width} = plan.field;
  const margin = 0.07 * length;
  const [side, end] = [length / 2 + margin, width / 2 + margin];
  svg.replaceChildren();
  svg.setAttribute("viewBox", `${-side} ${-end} ${2 * side} ${2 * end}`);
  for (const line of plan.lines) drawn("polyline", {points: line.map(([x, y]) => `${x},${-y}`).join(" ")}, svg);
  const between = margin / 2;
  for (const [word, x, y, turn] of [["far", 0, -end + between, 0], ["near", 0, end - between, 0], ["left", -side + between, 0, -90], ["right", side - between, 0, 90]]) {
    drawn("text", {x, y, "font-size": 0.6 * margin, transform: `rotate(${turn} ${x} ${y})`}, svg).textContent = word;
  }
}
