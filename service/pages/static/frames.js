// Chosen frames: thumbnails, and checks before the upload.

const THUMB = 320;
const JPEG = {start: 0xffd8, exif: 0xe1, name: 0x45786966, scan: 0xda, padding: 0xff};
const PNG = {signature: 8, exif: 0x65584966, around: 12};

/** Draw a picture as its pixels are stored, without the rotation of its Exif data: the service ignores that as well.
 *
 * Exif is cut out before decoding, since browsers differ in `imageOrientation: "none"`, which Chromium treats like
 * "from-image" since 2025.
 */
export async function pictureOf(file, options) {
  const bytes = await file.arrayBuffer();
  const view = new DataView(bytes);
  const isJpeg = bytes.byteLength > 1 && view.getUint16(0) === JPEG.start;
  const kept = [];
  let from = 0;
  for (const [begin, end] of isJpeg ? exifOfJpeg(view) : exifOfPng(view)) {
    kept.push(bytes.slice(from, begin));
    from = end;
  }
  return createImageBitmap(new Blob([...kept, bytes.slice(from)], {type: file.type}), options);
}

/** Position of Exif among the segments before the picture data; each begins with a marker and its length. */
function* exifOfJpeg(view) {
  for (let at = 2; at + 8 <= view.byteLength && view.getUint8(at) === 0xff;) {
    const marker = view.getUint8(at + 1);
    if (marker === JPEG.scan) return;
    const end = marker === JPEG.padding ? at + 1 : at + 2 + view.getUint16(at + 2);
    if (marker === JPEG.exif && view.getUint32(at + 4) === JPEG.name) yield [at, end];
    at = end;
  }
}

/** Position of Exif among the chunks: each is length, type, data and checksum. */
function* exifOfPng(view) {
  for (let at = PNG.signature; at + PNG.around <= view.byteLength;) {
    const end = at + PNG.around + view.getUint32(at);
    if (view.getUint32(at + 4) === PNG.exif) yield [at, end];
    at = end;
  }
}

/** Take the files of an input, also those that on a slow connection were chosen before this script was loaded. */
export function onFiles(input, add) {
  const take = () => {
    if (input.files.length === 0) return;
    add([...input.files]);
    input.value = "";
  };
  input.addEventListener("change", take);
  take();
}

/** A button that removes what `name` says. */
export function removeButton(name, remove) {
  const button = document.createElement("button");
  Object.assign(button, {type: "button", className: "quiet small-button", textContent: "Remove", ariaLabel: `Remove ${name}`});
  button.addEventListener("click", remove);
  return button;
}

/** Width and height of the stored pixels of a picture. */
export async function sizeOf(file) {
  const picture = await pictureOf(file);
  const size = [picture.width, picture.height];
  picture.close();
  return size;
}

/** A thumbnail of a file. */
export async function thumbnail(file) {
  const picture = await pictureOf(file, {resizeWidth: THUMB, resizeQuality: "medium"});
  const canvas = document.createElement("canvas");
  canvas.width = picture.width;
  canvas.height = picture.height;
  canvas.getContext("2d").drawImage(picture, 0, 0);
  picture.close();
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", file.name);
  return canvas;
}

/** The reason why a file cannot be a frame of this size; null: it can. */
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
