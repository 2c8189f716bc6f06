// Pictures from the server's bytes (`src/encode.rs`) onto the canvas, whole or not at all.

const HEADER_BYTES = 12;
const PART_BYTES = 12;
const KINDS = ["image/jpeg", "image/png"];

export class Picture {
  #canvas;
  #context;
  /** Reports whether a picture was shown. */
  hasPicture = false;

  constructor(canvas) {
    this.#canvas = canvas;
    this.#context = canvas.getContext("2d", { alpha: false });
  }

  /** Draws the changed parts; returns the number of the picture. */
  async show(buffer) {
    const view = new DataView(buffer);
    const short = (at) => view.getUint16(at, true);
    const long = (at) => view.getUint32(at, true);
    const [type, count, number] = [KINDS[view.getUint8(0)], short(2), long(4)];
    const [width, height] = [short(8), short(10)];
    let from = HEADER_BYTES + count * PART_BYTES;
    const parts = [];
    for (let i = 0; i < count; i++) {
      const at = HEADER_BYTES + i * PART_BYTES;
      const bytes = new Uint8Array(buffer, from, long(at + 8));
      from += bytes.length;
      const decoded = createImageBitmap(new Blob([bytes], { type }));
      parts.push(decoded.then((bitmap) => ({ bitmap, x: short(at), y: short(at + 2) })));
    }
    const decoded = await Promise.all(parts);
    if (this.#canvas.width !== width || this.#canvas.height !== height) {
      // A new size clears the canvas; the message has the whole picture.
      this.#canvas.width = width;
      this.#canvas.height = height;
    }
    for (const { bitmap, x, y } of decoded) {
      this.#context.drawImage(bitmap, x, y);
      bitmap.close();
    }
    this.hasPicture = true;
    return number;
  }
}
