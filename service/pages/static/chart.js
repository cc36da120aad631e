// uPlot in the colours of the page.

import {styled} from "./page.js";

const FONT = "12px system-ui, sans-serif";

/** Times by how far apart they stand (s): a clock of 24 hours, and the date where a new one begins. */
export const CLOCK = [
  [31536000, "{YYYY}", null, null, null, null, null, null, 1],
  [2419200, "{MMM}", "\n{YYYY}", null, null, null, null, null, 1],
  [86400, "{D} {MMM}", "\n{YYYY}", null, null, null, null, null, 1],
  [60, "{HH}:{mm}", "\n{D} {MMM} {YYYY}", null, "\n{D} {MMM}", null, null, null, 1],
  [1, "{HH}:{mm}:{ss}", "\n{D} {MMM} {YYYY}", null, "\n{D} {MMM}", null, null, null, 1],
];

/** What all axes have in common. */
export function axis(rest) {
  return {stroke: styled("--dim"), grid: {stroke: styled("--line"), width: 1}, ticks: {stroke: styled("--line"), width: 1}, font: FONT, labelFont: FONT, ...rest};
}

/** A chart that fills its place, and keeps doing so. */
export function fill(place, options, data) {
  const size = () => ({width: place.clientWidth, height: place.classList.contains("small") ? 170 : 280});
  const plot = new uPlot({...options, ...size()}, data, place);
  new ResizeObserver(() => { if (plot.width !== place.clientWidth) plot.setSize(size()); }).observe(place);
  return plot;
}
