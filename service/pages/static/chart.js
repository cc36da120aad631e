// uPlot in the colours of the page.

import {styled} from "./page.js";

const FONT = "12px system-ui, sans-serif";

/** Formats of the time axis by the distance of its ticks (s): a 24-hour clock, with the date where a day begins. */
export const CLOCK = [
  [31536000, "{YYYY}", null, null, null, null, null, null, 1],
  [2419200, "{MMM}", "\n{YYYY}", null, null, null, null, null, 1],
  [86400, "{D} {MMM}", "\n{YYYY}", null, null, null, null, null, 1],
  [60, "{HH}:{mm}", "\n{D} {MMM} {YYYY}", null, "\n{D} {MMM}", null, null, null, 1],
  [1, "{HH}:{mm}:{ss}", "\n{D} {MMM} {YYYY}", null, "\n{D} {MMM}", null, null, null, 1],
];

/** An axis in the style of the page. */
export function axis(rest) {
  return {stroke: styled("--dim"), grid: {stroke: styled("--line"), width: 1}, ticks: {stroke: styled("--line"), width: 1}, font: FONT, labelFont: FONT, ...rest};
}

/** A chart that fills its container, also after a change of its width. */
export function fill(place, options, data) {
  const size = () => ({width: place.clientWidth, height: place.classList.contains("small") ? 170 : 280});
  const plot = new uPlot({...options, ...size()}, data, place);
  new ResizeObserver(() => { if (plot.width !== place.clientWidth) plot.setSize(size()); }).observe(place);
  return plot;
}
