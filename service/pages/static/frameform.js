// Forms that upload frames of all or some cameras, with checks before and progress during the upload.

import {complain, root, signed} from "./page.js";
import {objection, onFiles, removeButton, thumbnail} from "./frames.js";

const form = document.getElementById("send-frames");
const button = form.querySelector("button[type=submit]");
const bar = document.getElementById("sent");
const missing = document.getElementById("missing");
const refused = document.getElementById("refused");

class Drop {
  constructor(box) {
    this.box = box;
    this.camera = box.dataset.camera;
    this.size = [Number(box.dataset.width), Number(box.dataset.height)];
    this.files = [];
    this.input = box.querySelector("input[type=file]");
    box.addEventListener("dragover", (event) => { event.preventDefault(); box.classList.add("over"); });
    box.addEventListener("dragleave", () => box.classList.remove("over"));
    box.addEventListener("drop", (event) => {
      event.preventDefault();
      event.stopPropagation();
      box.classList.remove("over");
      this.add([...event.dataTransfer.files]);
    });
  }

  async add(files) {
    const complaints = [];
    for (const file of files) {
      const why = this.files.length >= Number(form.dataset.most)
        ? `${form.dataset.most} frames of a camera are allowed.`
        : await objection(file, this.size, Number(form.dataset.bytes));
      if (why) complaints.push(why);
      else {
        this.files.push(file);
        await this.show(file);
      }
    }
    complain(this.box.querySelector(".wrong"), complaints.join(" "));
    tell();
  }

  async show(file) {
    const item = document.createElement("li");
    const remove = removeButton(file.name, () => {
      this.files = this.files.filter((one) => one !== file);
      item.remove();
      this.input.focus();
      tell();
    });
    const name = document.createElement("span");
    name.className = "mono breaks";
    name.textContent = file.name;
    item.append(await thumbnail(file), name, remove);
    this.box.querySelector(".thumbs").append(item);
  }
}

const drops = [...form.querySelectorAll(".drop")].map((box) => new Drop(box));
for (const drop of drops) onFiles(drop.input, (files) => drop.add(files));

/** Returns the cameras that still need a frame. */
function tell() {
  const without = drops.filter((drop) => drop.files.length === 0).map((drop) => drop.camera);
  const isEnough = "some" in form.dataset ? without.length < drops.length : without.length === 0;
  button.disabled = !isEnough;
  missing.textContent = isEnough ? "" : `No frame yet of ${without.join(", ")}`;
}

/** The options for the interface; unset ones are left out. */
function options() {
  const chosen = {};
  for (const field of form.querySelectorAll(".options [name]")) {
    if (field.type === "checkbox") {
      if (field.checked) chosen[field.name] = true;
    } else if (field.value) chosen[field.name] = "number" in field.dataset ? Number(field.value) : field.value;
  }
  return chosen;
}

function refuse(problem) {
  complain(refused, problem.detail || problem.title || "The service did not take the frames.");
  bar.hidden = true;
  tell();
}

function send(event) {
  event.preventDefault();
  const body = new FormData();
  for (const drop of drops) for (const file of drop.files) body.append(drop.camera, file);
  body.append("options", JSON.stringify(options()));
  // Unlike fetch, it reports the progress of an upload.
  const request = new XMLHttpRequest();
  request.open("POST", form.dataset.address);
  for (const [name, value] of Object.entries(signed)) request.setRequestHeader(name, value);
  request.upload.addEventListener("progress", ({loaded, total}) => {
    bar.value = loaded / total;
    missing.textContent = `${(loaded / 1e6).toFixed(1)} of ${(total / 1e6).toFixed(1)} MB`;
  });
  request.addEventListener("load", () => {
    const answer = JSON.parse(request.responseText);
    if (request.status < 300) location.assign(`${root}/ui/jobs/${answer.id}`);
    else refuse(answer);
  });
  request.addEventListener("error", () => refuse({detail: "The service cannot be reached."}));
  refused.hidden = true;
  bar.hidden = false;
  button.disabled = true;
  request.send(body);
}

document.addEventListener("dragover", (event) => event.preventDefault());
document.addEventListener("drop", (event) => {
  event.preventDefault();
  for (const drop of drops) drop.add([...event.dataTransfer.files].filter((file) => file.name.toLowerCase().includes(drop.camera)));
});
form.addEventListener("submit", send);
tell();
