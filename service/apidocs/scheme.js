// Sets RapiDoc's theme to the browser's preferred colour scheme, also after a change.

const dark = matchMedia("(prefers-color-scheme: dark)");
const page = document.querySelector("rapi-doc");

function dress() {
  page.setAttribute("theme", dark.matches ? "dark" : "light");
  // Links and buttons: legible on both backgrounds.
  page.setAttribute("primary-color", dark.matches ? "#66bb6a" : "#2e7d32");
}

dark.addEventListener("change", dress);
dress();
