// Chart of the stitch error and the movements of a venue over time, with the limit of the gate.

import {CLOCK, axis, fill} from "./chart.js";
import {call, onScheme, say, styled} from "./page.js";
import {whenShown} from "./parts.js";

const CAMERA_COLOURS = ["--new", "--stored", "--mask", "--live", "--good"];
const HOUR = 3600;

function px(plot, value) {
  return value === null || value === undefined ? "–" : `${value.toPrecision(3)} px`;
}

function draw(place, history, isLogarithmic) {
  place.replaceChildren();
  // A single moment gets an hour before and after it.
  const around = (plot, first, last) => (history.at.length === 1 ? [history.at[0] - HOUR, history.at[0] + HOUR] : [first, last]);
  const limit = history.stitch_error_limit_px;
  const cameras = Object.keys(history.moved_px);
  // Zero has no logarithm.
  const shown = (values) => (isLogarithmic ? values.map((value) => (value ? value : null)) : values);
  const data = [history.at, shown(history.stitch_error_px), history.at.map(() => limit), ...cameras.map((camera) => shown(history.moved_px[camera]))];
  const points = {show: history.at.length < 80, size: 6};
  const distr = isLogarithmic ? 3 : 1;
  const scale = isLogarithmic ? {distr} : {distr, range: (plot, low, high) => [0, Math.max(high || 0, limit || 0, 0.1) * 1.08]};
  const movement = isLogarithmic ? {distr} : {distr, range: (plot, low, high) => [0, Math.max(high || 0, 1) * 1.08]};
  fill(place, {
    scales: {x: {time: true, range: around}, px: scale, moved: movement},
    axes: [axis({values: CLOCK}), axis({scale: "px", label: "stitch error, px (10 cm on the pitch)", size: 60}), axis({scale: "moved", side: 1, label: "moved, px in the picture", size: 60, grid: {show: false}})],
    series: [
      {label: "Ended", value: "{YYYY}-{MM}-{DD} {HH}:{mm}"},
      {label: "Stitch error", scale: "px", stroke: styled("--good"), width: 2, points, value: px, spanGaps: true},
      {label: "Gate", scale: "px", stroke: styled("--bad"), width: 1.5, dash: [6, 5], points: {show: false}, value: px},
      ...cameras.map((camera, number) => ({label: `${camera} moved`, scale: "moved", stroke: styled(CAMERA_COLOURS[number % CAMERA_COLOURS.length]), width: 1.2, dash: [2, 3], points, value: px, spanGaps: true})),
    ],
  }, data);
}

whenShown(async (root, signal) => {
  const place = root.querySelector("#chart");
  if (!place) return;
  const logarithmic = root.querySelector("#log-scale");
  try {
    const history = await call("GET", place.dataset.history);
    const drawIt = () => draw(place, history, logarithmic.checked);
    drawIt();
    logarithmic.addEventListener("change", drawIt);
    onScheme(drawIt, signal);
  } catch (refused) {
    say(refused.message, true);
  }
});
