// The button that runs all failed jobs of a list again.

import {ask, call, root, say} from "./page.js";

async function runAgain(button) {
  const {asks, effect, again} = button.dataset;
  if (!await ask({asks, effect, does: button.textContent.trim()})) return;
  button.disabled = true;
  const jobs = again.split(" ");
  const refusals = [];
  for (const job of jobs) {
    try {
      await call("POST", `${root}/jobs/${job}/again`);
    } catch (refused) {
      refusals.push(refused.message);
    }
  }
  button.disabled = false;
  say([`${jobs.length - refusals.length} of ${jobs.length} jobs run again.`, ...new Set(refusals)].join(" "), refusals.length > 0);
}

document.addEventListener("click", (event) => {
  const button = event.target.closest("button[data-again]");
  if (button) runAgain(button);
});
