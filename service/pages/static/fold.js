// Foldable sections of a long page. On a phone they begin folded, so that the verdict and its pictures come first; rarely
// used tools begin folded on every screen.

const narrow = matchMedia("(max-width: 40rem)");

/** On a narrow screen, fold all sections except the target of the address; on a wide one, open all that are not `shut`. */
function fold() {
  const wanted = location.hash ? document.getElementById(location.hash.slice(1)) : null;
  for (const one of document.querySelectorAll("details.fold")) one.open = one.contains(wanted) || !(narrow.matches || one.matches(".shut"));
}

/** Open the section that a link of the page targets. */
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
