// Frames that somebody chose: shown small, and looked at before they travel.

const THUMB = 320;

/** Width and height of a picture as it is stored, however its camera was held. */
export async function sizeOf(file) {
  const picture = await createImageBitmap(file, {imageOrientation: "none"});
  const size = [picture.width, picture.height];
  picture.close();
  return size;
}

/** A small picture of a file. */
export async function thumbnail(file) {
  const picture = await createImageBitmap(file, {imageOrientation: "none", resizeWidth: THUMB, resizeQuality: "medium"});
  const canvas = document.createElement("canvas");
  canvas.width = picture.width;
  canvas.height = picture.height;
  canvas.getContext("2d").drawImage(picture, 0, 0);
  picture.close();
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", file.name);
  return canvas;
}

/** Why a file cannot be a frame of this size; null: it can. */
export async function objection(file, [width, height], most) {
  if (!["image/jpeg", "image/png"].includes(file.type)) return `${file.name} is neither a JPEG nor a PNG.`;
  if (file.size > most) return `${file.name} has ${(file.size / 1e6).toFixed(1)} MB; ${(most / 1e6).toFixed(0)} MB are allowed.`;
  try {
    const got = await sizeOf(file);
    if (got[0] === width && got[1] === height) return null;
    return `${file.name} has ${got[0]} × ${got[1]} pixels; this camera takes ${width} × ${height}.`;
  } catch {
    return `${file.name} cannot be read as a picture.`;
  }
}
