// RapiDoc is told its theme: dark where the browser prefers that, and when it comes to.

const dark = matchMedia("(prefers-color-scheme: dark)");
const page = document.querySelector("rapi-doc");

function dress() {
  page.setAttribute("theme", dark.matches ? "dark" : "light");
  // Links and buttons: legible on either ground.
  page.setAttribute("primary-color", dark.matches ? "#66bb6a" : "#2e7d32");
}

dark.addEventListener("change", dress);
dress();
