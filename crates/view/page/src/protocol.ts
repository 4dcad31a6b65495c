/** What goes over the socket; docs/view-protocol.md says it in words. */

export const PROTOCOL = 1;

export type Options = Record<string, string>;
export type Vec3 = [number, number, number];

export interface CameraState {
  eye: Vec3;
  forward: Vec3;
  up: Vec3;
  right: Vec3;
  projection: string;
  fov: number | null;
  lens_radius: number;
  focal_distance: number;
  shutter: [number, number];
  scale: number;
  animated: boolean;
  moving: boolean;
  size: number;
}

export interface PaneState {
  options: Options;
  generation: number;
  camera: CameraState;
  size: [number, number];
  origin: [number, number];
  command: string;
  to_srgb: [Vec3, Vec3, Vec3];
  max_depth: number;
  integrator: string;
  raw: boolean;
  triangles: number;
  lights: number;
}

export interface State {
  type: "state";
  panes: PaneState[];
  paused: boolean;
  adaptive: boolean;
  goal: { spp: number | null; error: number | null };
  problems: string[];
  refused: string | null;
  reference: { name: string; stamp: number; size: [number, number] } | null;
}

export interface PaneProgress {
  spp: number;
  seconds: number;
  rays: number;
  mrays: number;
  error: number | null;
  finished: boolean;
  latency_ms: number | null;
}

export interface Progress {
  type: "progress";
  panes: PaneProgress[];
  memory: number | null;
  threads: number;
}

export interface Hello {
  type: "hello";
  protocol: number;
  version: string;
  scene: string;
  threads: number;
}

export interface Answer {
  type: "answer";
  id: number;
  value?: unknown;
}

export interface Refusal {
  type: "refusal";
  id: number | null;
  why: string;
}

export type Told = State | Progress | Hello | Answer | Refusal;

/** A number; what JSON cannot say comes as a text. */
export type Num = number | string;

export type PathEvent =
  | { event: "vertex"; depth: number; p: Num[]; n: Num[]; material: string; lobe: string; throughput: Num[] }
  | {
      event: "light";
      depth: number;
      light: number | null;
      sampled: boolean;
      direction: Num[];
      end: Num[] | null;
      pdf: Num;
      other_pdf: Num;
      weight: Num;
      value: Num[];
      rgb: Num[];
      occluded: boolean;
    }
  | {
      event: "bounce";
      direction: Num[];
      pdf: Num;
      weight: Num[];
      specular: boolean;
      transmission: boolean;
      survival: Num;
    };

export interface PathTold {
  pixel: [number, number];
  sample: number;
  broken?: boolean;
  rgb: Num[];
  luminance: Num;
  radiance: Num[];
  film: [number, number];
  filter_weight: number;
  wavelengths: Num[] | null;
  eye: Num[];
  told: boolean;
  exact: boolean | null;
  sum: Num[];
  contributions: number;
  rays: { camera: number; scattered: number; shadow: number };
  cut: boolean;
  events: (PathEvent | null)[];
  command: string;
}

export interface Explored {
  pixel: [number, number];
  generation: number;
  samples: number;
  in_picture: number;
  rgb: Num[];
  luminance: number;
  half_width: number | null;
  same_as_picture: boolean | null;
  curve: [number, number, number | null][];
  brightest: PathTold[];
  usual: PathTold[];
  bright_share: number;
  bright_samples: number;
  black: number;
  took_ms: number;
  splats: boolean;
}

export interface Probed {
  p: Vec3;
  n: Vec3;
  depth: number;
  focal_distance: number;
  material: number;
}

export interface CoarseFrame {
  kind: "coarse";
  frame: number;
  pane: number;
  generation: number;
  width: number;
  height: number;
  stride: number;
  columns: number;
  rows: number;
  texels: Uint16Array;
}

export interface TileFrame {
  kind: "tiles";
  frame: number;
  pane: number;
  generation: number;
  width: number;
  height: number;
  tile: number;
  tiles: { column: number; row: number; width: number; height: number; samples: number; texels: Uint16Array }[];
}

export interface Plane {
  kind: "plane";
  id: number;
  width: number;
  height: number;
  texels: Uint16Array;
}

export interface Scan {
  kind: "scan";
  id: number;
  columns: number;
  rows: number;
  points: Float32Array;
}

/** Reads a binary message; null if it is of a kind that this page does not know. */
export function decode(buffer: ArrayBuffer): CoarseFrame | TileFrame | Plane | Scan | null {
  const view = new DataView(buffer);
  const word = (i: number): number => view.getUint32(4 * i, true);
  switch (word(0)) {
    case 1:
      return {
        kind: "coarse",
        frame: word(1),
        pane: word(2),
        generation: word(3),
        width: word(4),
        height: word(5),
        stride: word(6),
        columns: word(7),
        rows: word(8),
        texels: new Uint16Array(buffer, 36),
      };
    case 2: {
      const [width, height, count, tile] = [word(4), word(5), word(6), word(7)];
      const tiles: TileFrame["tiles"] = [];
      let at = 32;
      for (let k = 0; k < count; k++) {
        const place = view.getUint32(at, true);
        const [column, row] = [place & 0xffff, place >>> 16];
        const w = Math.min(tile, width - column * tile);
        const h = Math.min(tile, height - row * tile);
        const samples = view.getUint32(at + 4, true);
        tiles.push({ column, row, width: w, height: h, samples, texels: new Uint16Array(buffer, at + 8, w * h * 4) });
        at += 8 + w * h * 8;
      }
      return { kind: "tiles", frame: word(1), pane: word(2), generation: word(3), width, height, tile, tiles };
    }
    case 3:
      return { kind: "plane", id: word(1), width: word(2), height: word(3), texels: new Uint16Array(buffer, 16) };
    case 4:
      return {
        kind: "scan",
        id: word(1),
        columns: word(2),
        rows: word(3),
        points: new Float32Array(buffer.slice(20)),
      };
    default:
      return null;
  }
}
