// Sections of a long page that can be folded: on a phone they begin folded, so that the verdict and its pictures come first,
// and tools that few look at on every screen.

const narrow = matchMedia("(max-width: 40rem)");

/** Fold all on a narrow screen but what the address leads to, and open all on a wide one that are not `shut`. */
function fold() {
  const wanted = location.hash ? document.getElementById(location.hash.slice(1)) : null;
  for (const one of document.querySelectorAll("details.fold")) one.open = one.contains(wanted) || !(narrow.matches || one.matches(".shut"));
}

/** Open the section that a link of the page leads to. */
function reveal() {
  const wanted = location.hash ? document.getElementById(location.hash.slice(1)) : null;
  const section = wanted?.closest("details.fold");
  if (!section || section.open) return;
  section.open = true;
  wanted.scrollIntoView();
}

narrow.addEventListener("change", fold);
addEventListener("hashchange", reveal);
fold();
