// Pages that update themselves: a venue by its events, lists by polling.

import {refresh} from "./parts.js";
import {listen} from "./stream.js";

const OFTEN = 5000;
const PAUSE = 100;
const KINDS = [
  "poses.current", "poses.changed", "venue.created", "venue.changed", "venue.deleted",
  "job.queued", "job.succeeded", "job.failed", "job.cancelled", "alarm.began", "alarm.ended",
];
const box = document.querySelector("[data-follows]");

function followVenue() {
  let {seen} = box.dataset;
  let timer = 0;
  const happened = ({lastEventId}) => {
    // The first event of a stream has the state that the page already shows.
    if (lastEventId === seen) return;
    seen = lastEventId;
    clearTimeout(timer);
    timer = setTimeout(refresh, PAUSE);
  };
  const lost = (isLost) => {
    if (box.hidden === isLost) box.querySelector("span").textContent = new Date().toLocaleTimeString("sv");
    box.hidden = !isLost;
  };
  listen(box.dataset.follows, Object.fromEntries(KINDS.map((kind) => [kind, happened])), new AbortController().signal, lost);
}

if (box) followVenue();
else if (document.querySelector("[data-part]")) {
  const unlessHidden = () => document.hidden || refresh();
  setInterval(unlessHidden, OFTEN);
  document.addEventListener("visibilitychange", unlessHidden);
}
