// Predicted occupancy as coloured images, one per instant, drawn in the person's own turned frame.

import { rgb } from "./palette.js";

const STRONGEST = 0.88; // opacity

// 256 colours from nothing to the strongest, as RGBA bytes.
function ramp(colours) {
  const [low, high] = [rgb(colours.heatLow), rgb(colours.heatHigh)];
  const table = new Uint8ClampedArray(1024);
  for (let i = 0; i < 256; i += 1) {
    const t = i / 255;
    for (let c = 0; c < 3; c += 1) table[4 * i + c] = low[c] + (high[c] - low[c]) * t;
    table[4 * i + 3] = 255 * STRONGEST * t ** 1.25;
  }
  return table;
}

export class Heat {
  constructor(colours) {
    this.table = ramp(colours);
    this.key = colours.key;
  }

  // Images of one person: one per instant, and `whole`, the strongest over all instants after now.
  paint(heat) {
    const [count, rows, columns] = heat.shape;
    const size = rows * columns;
    const whole = new Uint8Array(size);
    const images = [];
    for (let k = 0; k < count; k += 1) {
      const pixels = heat.pixels.subarray(k * size, (k + 1) * size);
      images.push(this.image(pixels, rows, columns));
      if (k > 0) for (let i = 0; i < size; i += 1) if (pixels[i] > whole[i]) whole[i] = pixels[i];
    }
    return { ...heat, images, whole: this.image(whole, rows, columns) };
  }

  image(pixels, rows, columns) {
    const canvas = document.createElement("canvas");
    canvas.width = columns + 2; // an empty frame, so that smoothing fades out instead of stopping at the edge
    canvas.height = rows + 2;
    const data = new ImageData(columns + 2, rows + 2);
    for (let i = 0; i < rows; i += 1) {
      for (let j = 0; j < columns; j += 1) {
        const from = 4 * pixels[i * columns + j];
        data.data.set(this.table.subarray(from, from + 4), 4 * ((i + 1) * (columns + 2) + j + 1));
      }
    }
    canvas.getContext("2d").putImageData(data, 0, 0);
    return canvas;
  }
}

// Draws the person's prediction: `instant` steps ahead (fractions fade over), or the whole of it when null.
export function drawHeat(ctx, view, painted, instant, opacity) {
  ctx.save();
  const { origin, rotation, spacing, first } = painted;
  const rowStep = view.along(rotation[0][0] * spacing, rotation[1][0] * spacing);
  const columnStep = view.along(rotation[0][1] * spacing, rotation[1][1] * spacing);
  const corner = view.point(
    origin[0] + rotation[0][0] * first[0] + rotation[0][1] * first[1],
    origin[1] + rotation[1][0] * first[0] + rotation[1][1] * first[1],
  );
  // Pixel (1, 1) of the framed image is cell (0, 0); its centre lies at (1.5, 1.5).
  ctx.transform(
    columnStep[0], columnStep[1], rowStep[0], rowStep[1],
    corner[0] - 1.5 * (columnStep[0] + rowStep[0]), corner[1] - 1.5 * (columnStep[1] + rowStep[1]),
  );
  ctx.imageSmoothingEnabled = true;
  ctx.imageSmoothingQuality = "high";
  for (const [image, share] of layers(painted, instant)) {
    ctx.globalAlpha = opacity * share;
    ctx.drawImage(image, 0, 0);
  }
  ctx.restore();
}

function layers(painted, instant) {
  if (instant === null) return [[painted.whole, 1]];
  const { instants, images } = painted;
  let i = 0;
  while (i < instants.length - 2 && instants[i + 1] <= instant) i += 1;
  if (images.length === 1) return [[images[0], 1]];
  const share = Math.min(1, Math.max(0, (instant - instants[i]) / (instants[i + 1] - instants[i])));
  return [[images[i], 1 - share], [images[i + 1], share]];
}
