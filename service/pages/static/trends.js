// Trends of cameras: each night with one sigma and its moving average, in the colour of what its control charts say.

import {CLOCK, axis, fill} from "./chart.js";
import {onScheme, styled} from "./page.js";
import {whenShown} from "./parts.js";

const COLOURS = {quiet: "--new", drifting: "--live", alarm: "--bad"};
// Of more nights only those beyond the limits have a dot, and a small one.
const NIGHTS_WITH_DOTS = 130;
const INVISIBLE = {points: {show: false}, class: "unnamed"};

function draw(place) {
  const {unit, places, scale, at, value, sigma, average, state} = JSON.parse(place.dataset.trend);
  const isLong = at.length > NIGHTS_WITH_DOTS;
  const spread = (sign) => value.map((one, night) => one + sign * sigma[night]);
  const nights = (wanted) => value.map((one, night) => (state[night] === wanted ? one : null));
  const written = (plot, one) => (one === null || one === undefined ? "–" : `${one.toFixed(places)} ${unit}`);
  const dots = (wanted) => {
    const colour = styled(COLOURS[wanted]);
    const points = {show: !isLong || wanted !== "quiet", size: isLong ? 4 : wanted === "quiet" ? 5 : 7, fill: colour, stroke: colour};
    return {paths: () => null, points, class: "unnamed"};
  };
  place.replaceChildren();
  // A distance is never below zero, a focal length may be shorter.
  fill(place, {
    scales: {x: {time: true}, y: {range: (plot, low, high) => [scale[0] && Math.min(1.08 * low, scale[0]), Math.max(1.08 * high, scale[1])]}},
    axes: [axis({values: CLOCK}), axis({size: 60})],
    bands: [{series: [2, 1], fill: `color-mix(in srgb, ${styled("--new")} 22%, transparent)`}],
    series: [
      {label: "Night", value: "{YYYY}-{MM}-{DD}"},
      INVISIBLE,
      INVISIBLE,
      ...Object.keys(COLOURS).map(dots),
      {label: "Average", stroke: styled("--text"), width: 1.8, points: {show: false}, value: written},
      {label: "Value", paths: () => null, points: {show: false}, value: (plot, one, series, night) => (night === null ? "–" : `${one.toFixed(places)} ± ${sigma[night].toFixed(places)} ${unit}`)},
    ],
  }, [at, spread(-1), spread(1), ...Object.keys(COLOURS).map(nights), average, value]);
}

whenShown((root, signal) => {
  for (const place of root.querySelectorAll("[data-trend]")) {
    draw(place);
    onScheme(() => draw(place), signal);
  }
});
