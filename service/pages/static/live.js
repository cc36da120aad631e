// A job that is going on: its events move the bar, the stages and the curve of its loss; its end loads the page again.

import {axis, fill} from "./chart.js";
import {onScheme, styled} from "./page.js";

const LEGENDS = {queued: "in the queue", running: "starting"};

class Live {
  constructor(box) {
    this.box = box;
    this.generations = [];
    this.losses = [];
    this.drawLoss();
    onScheme(() => this.drawLoss());
    this.events = new EventSource(box.dataset.events);
    this.events.addEventListener("progress", (event) => this.show(JSON.parse(event.data)));
    this.events.addEventListener("end", () => {
      this.events.close();
      location.reload();
    });
  }

  part(name) {
    return this.box.querySelector(`[data-live="${name}"]`);
  }

  show(job) {
    const {progress} = job;
    this.part("status").lastElementChild.textContent = job.status[0].toUpperCase() + job.status.slice(1);
    const place = job.queue_position ? `, place ${job.queue_position}` : "";
    const said = progress ? progress.stage : LEGENDS[job.status] + place;
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

for (const box of document.querySelectorAll("[data-events]")) new Live(box);
