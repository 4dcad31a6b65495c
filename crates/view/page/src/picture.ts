/** The page's copy of a pane: what the server has sent of it, ready to be drawn, measured and pointed at. */

import type { CoarseFrame, Plane, TileFrame } from "./protocol.ts";
import { half } from "./tone.ts";

export class Picture {
  generation = 0;
  width = 0;
  height = 0;
  tile = 16;
  /** Red, green, blue and relative standard error of each pixel, as half floats. */
  texels = new Uint16Array(0);
  /** Samples of each tile; 0 where only the coarse picture is. */
  samples = new Float32Array(0);
  coarse: CoarseFrame | null = null;
  /** Tiles that whoever draws has not seen yet, by number; and whether everything is new. */
  readonly dirty = new Set<number>();
  fresh = true;
  coarseFresh = false;
  /** Counts frames. */
  version = 0;

  get columns(): number {
    return Math.ceil(this.width / this.tile);
  }

  private begin(generation: number, width: number, height: number): void {
    if (this.generation === generation) return;
    if (width !== this.width || height !== this.height) {
      [this.width, this.height] = [width, height];
      this.texels = new Uint16Array(width * height * 4);
      this.samples = new Float32Array(this.columns * Math.ceil(height / this.tile));
      this.coarse = null;
      this.fresh = true;
    }
    this.generation = generation;
    this.samples.fill(0);
    this.dirty.clear();
  }

  take(frame: CoarseFrame | TileFrame): void {
    const first = this.generation !== frame.generation;
    this.begin(frame.generation, frame.width, frame.height);
    this.version += 1;
    if (frame.kind === "coarse") {
      this.coarse = frame;
      this.coarseFresh = true;
      return;
    }
    // A small picture has no coarse one before it: nothing of the last picture may shine through.
    if (first) this.coarse = null;
    for (const t of frame.tiles) {
      const [x0, y0] = [t.column * frame.tile, t.row * frame.tile];
      for (let y = 0; y < t.height; y++) {
        this.texels.set(t.texels.subarray(y * t.width * 4, (y + 1) * t.width * 4), ((y0 + y) * this.width + x0) * 4);
      }
      const index = t.row * this.columns + t.column;
      this.samples[index] = t.samples;
      this.dirty.add(index);
    }
  }

  /** Red, green, blue, relative standard error, samples. */
  pixel(x: number, y: number): [number, number, number, number, number] | null {
    if (x < 0 || y < 0 || x >= this.width || y >= this.height) return null;
    const samples = this.samples[Math.floor(y / this.tile) * this.columns + Math.floor(x / this.tile)]!;
    if (samples > 0) {
      const at = (y * this.width + x) * 4;
      const t = this.texels;
      return [half(t[at]!), half(t[at + 1]!), half(t[at + 2]!), half(t[at + 3]!), samples];
    }
    if (!this.coarse) return null;
    const c = this.coarse;
    const at = (Math.min(c.rows - 1, Math.floor(y / c.stride)) * c.columns + Math.min(c.columns - 1, Math.floor(x / c.stride))) * 4;
    return [half(c.texels[at]!), half(c.texels[at + 1]!), half(c.texels[at + 2]!), NaN, 0];
  }

  /** Whether every pixel has been rendered. */
  get whole(): boolean {
    return this.samples.length > 0 && this.samples.every((n) => n > 0);
  }
}

/** A pixel of a plane. */
export function planePixel(plane: Plane, x: number, y: number): [number, number, number] | null {
  if (x < 0 || y < 0 || x >= plane.width || y >= plane.height) return null;
  const at = (y * plane.width + x) * 4;
  return [half(plane.texels[at]!), half(plane.texels[at + 1]!), half(plane.texels[at + 2]!)];
}

/** The mean over a map of differences, which the server puts into its last channel. */
export const planeMean = (plane: Plane): number => half(plane.texels[3] ?? 0);
