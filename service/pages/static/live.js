// A running job: its events update progress bar, stages and loss curve; its end reloads the page.

import {axis, fill} from "./chart.js";
import {loadAgain, onScheme, styled} from "./page.js";
import {refresh, whenShown} from "./parts.js";
import {listen} from "./stream.js";

const LEGENDS = {queued: "in the queue", running: "starting"};
const ICONS = {queued: "wait", running: "run"};

class Live {
  constructor(box, signal) {
    this.box = box;
    this.generations = [];
    this.losses = [];
    this.drawLoss();
    onScheme(() => this.drawLoss(), signal);
    const ended = new AbortController();
    signal.addEventListener("abort", () => ended.abort());
    listen(box.dataset.events, {
      progress: (event) => this.show(JSON.parse(event.data)),
      end: () => {
        ended.abort();
        if ("partOfVenue" in box.dataset) refresh();
        else loadAgain();
      },
    }, ended.signal);
  }

  part(name) {
    return this.box.querySelector(`[data-live="${name}"]`);
  }

  show(job) {
    const {progress} = job;
    showStatus(job);
    const place = job.queue_position ? `, place ${job.queue_position}` : "";
    // As in the macro `stage` of parts.html.
    const stage = job.kind === "find" && progress?.stage === "evolution" ? "search" : progress?.stage;
    const said = progress ? stage + remaining(progress) : LEGENDS[job.status] + place;
    if (this.part("stage").textContent !== said) this.part("stage").textContent = said;
    if (!progress) return;
    this.box.querySelector("progress").value = progress.fraction;
    this.showStages(progress.stage);
    if (progress.generation !== null && progress.loss !== null) this.addLoss(progress.generation, progress.loss);
  }

  showStages(stage) {
    const stages = [...(this.part("stages")?.children || [])];
    const now = stages.findIndex((one) => one.dataset.stage === stage);
    stages.forEach((one, number) => {
      one.classList.toggle("past", number < now);
      if (number === now) one.setAttribute("aria-current", "step");
      else one.removeAttribute("aria-current");
    });
  }

  drawLoss() {
    const place = this.part("loss");
    if (!place) return;
    place.replaceChildren();
    this.plot = fill(place, {
      legend: {show: false},
      scales: {x: {time: false}},
      axes: [axis({label: "generation"}), axis({label: "loss", size: 60})],
      series: [{}, {stroke: styled("--live"), width: 2, points: {show: true, size: 5}}],
    }, [this.generations, this.losses]);
  }

  addLoss(generation, loss) {
    const known = this.generations.at(-1);
    if (!this.plot || (known !== undefined && generation <= known)) return;
    this.generations.push(generation);
    this.losses.push(loss);
    this.plot.setData([this.generations, this.losses]);
  }
}

/** The estimated remaining time, in words; empty without an estimate. */
function remaining({expected_end: end}) {
  if (!end) return "";
  const minutes = Math.ceil((new Date(end) - Date.now()) / 60_000);
  return minutes > 0 ? `, about ${minutes} min left` : ", takes longer than expected";
}

/** Update every badge of a job. */
function showStatus({id, status}) {
  for (const badge of document.querySelectorAll(`[data-status-of="${id}"]`)) {
    const icon = badge.querySelector("use");
    icon.setAttribute("href", icon.getAttribute("href").replace(/#.*/, `#${ICONS[status]}`));
    badge.lastChild.textContent = status[0].toUpperCase() + status.slice(1);
  }
}

whenShown((root, signal) => {
  for (const box of root.querySelectorAll("[data-events]")) new Live(box, signal);
});
