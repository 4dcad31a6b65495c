/** Paths in space, among the points that the camera sees and those that light has passed. */

import { add, cross, dot, length, sub, times, turn, unit } from "./camera.ts";
import { $ } from "./dom.ts";
import type { CameraState, Num, PathTold, Scan, Vec3 } from "./protocol.ts";

/** A piece of a path. */
export interface Segment {
  from: Vec3;
  to: Vec3;
  kind: "camera" | "scatter" | "specular" | "shadow" | "blocked";
  /** Goes on for ever. */
  endless: boolean;
}

export const vec = (v: Num[]): Vec3 => v.slice(0, 3).map(Number) as Vec3;

/** A path's pieces and the points between them. */
export function segments(path: PathTold, far: number): { segments: Segment[]; points: Vec3[]; lamps: Vec3[] } {
  const out: Segment[] = [];
  const points: Vec3[] = [];
  const lamps: Vec3[] = [];
  let at = vec(path.eye);
  let kind: Segment["kind"] = "camera";
  let going: { direction: Vec3 } | null = null;
  let drawn = true;
  for (const event of path.events) {
    if (!event) continue;
    if (event.event === "vertex") {
      const p = vec(event.p);
      out.push({ from: at, to: p, kind, endless: false });
      points.push(p);
      at = p;
      going = null;
    } else if (event.event === "bounce") {
      kind = event.specular ? "specular" : "scatter";
      going = { direction: vec(event.direction) };
      drawn = false;
    } else {
      const endless = event.end === null;
      const to: Vec3 = event.end ? vec(event.end) : add(at, times(vec(event.direction), far));
      if (event.sampled) out.push({ from: at, to, kind: event.occluded ? "blocked" : "shadow", endless });
      else {
        out.push({ from: at, to, kind, endless });
        drawn = true;
      }
      if (!endless) lamps.push(to);
    }
  }
  // A last direction that met nothing, or that roulette ended.
  if (going && !drawn) out.push({ from: at, to: add(at, times(going.direction, far * 0.25)), kind, endless: true });
  return { segments: out, points, lamps };
}

const COLORS: Record<Segment["kind"], string> = {
  camera: "--k-camera",
  scatter: "--k-scatter",
  specular: "--k-specular",
  shadow: "--k-shadow",
  blocked: "--k-blocked",
};

/** A colour of the style sheet, #rrggbb, in numbers. */
const rgb = (text: string): Vec3 => [1, 3, 5].map((i) => parseInt(text.slice(i, i + 2), 16) || 0) as Vec3;

/** A canvas without ceremony. */
class Raster {
  readonly data: ImageData;

  constructor(
    private readonly width: number,
    private readonly height: number,
  ) {
    this.data = new ImageData(width, height);
  }

  private put(x: number, y: number, color: Vec3, alpha: number): void {
    if (x < 0 || y < 0 || x >= this.width || y >= this.height) return;
    const at = 4 * (y * this.width + x);
    const d = this.data.data;
    const below = d[at + 3]!;
    const all = alpha + (below * (255 - alpha)) / 255;
    for (let k = 0; k < 3; k++) d[at + k] = (color[k]! * alpha + (d[at + k]! * below * (255 - alpha)) / 255) / all;
    d[at + 3] = all;
  }

  dot(x: number, y: number, size: number, color: Vec3, alpha: number): void {
    const [x0, y0] = [Math.round(x - size / 2), Math.round(y - size / 2)];
    for (let j = 0; j < size; j++) for (let i = 0; i < size; i++) this.put(x0 + i, y0 + j, color, alpha);
  }

  line(x0: number, y0: number, x1: number, y1: number, color: Vec3, alpha: number): void {
    const steps = Math.ceil(Math.max(Math.abs(x1 - x0), Math.abs(y1 - y0)));
    if (!(steps < 4000)) return;
    for (let i = 0; i < steps; i++) {
      const t = i / steps;
      this.put(Math.round(x0 + (x1 - x0) * t), Math.round(y0 + (y1 - y0) * t), color, alpha);
    }
  }
}

export class Space {
  private readonly canvas = $<HTMLCanvasElement>("space");
  private readonly ink: CanvasRenderingContext2D;
  private scan: Scan | null = null;
  private paths: PathTold[] = [];
  private chosen = 0;
  private camera: CameraState | null = null;
  private eye: Vec3 = [0, 0, -5];
  private target: Vec3 = [0, 0, 0];
  private up: Vec3 = [0, 1, 0];
  private size = 1;
  private waiting = false;
  private readonly pointers = new Map<number, [number, number]>();
  /** Takes the mirrored hand of the scene's camera, so that left stays left. */
  private hand = 1;

  constructor() {
    this.ink = this.canvas.getContext("2d", { willReadFrequently: true })!;
    new ResizeObserver(() => this.refresh()).observe($("space-box"));
    const c = this.canvas;
    c.addEventListener("pointerdown", (e) => {
      c.setPointerCapture(e.pointerId);
      this.pointers.set(e.pointerId, [e.clientX, e.clientY]);
    });
    c.addEventListener("pointermove", (e) => {
      const before = this.pointers.get(e.pointerId);
      if (!before) return;
      const [dx, dy] = [e.clientX - before[0], e.clientY - before[1]];
      const other = [...this.pointers.entries()].find(([id]) => id !== e.pointerId)?.[1];
      if (other) {
        const [a, b] = [Math.hypot(before[0] - other[0], before[1] - other[1]), Math.hypot(e.clientX - other[0], e.clientY - other[1])];
        if (a > 0 && b > 0) this.near(a / b);
      } else if (e.shiftKey || (e.buttons & 6) !== 0) this.pan(dx, dy);
      else this.orbit((dx / c.clientHeight) * 3, (dy / c.clientHeight) * 3);
      this.pointers.set(e.pointerId, [e.clientX, e.clientY]);
    });
    for (const end of ["pointerup", "pointercancel"]) c.addEventListener(end, (e) => this.pointers.delete((e as PointerEvent).pointerId));
    c.addEventListener("contextmenu", (e) => e.preventDefault());
    c.addEventListener("wheel", (e) => {
      e.preventDefault();
      this.near(Math.exp(Math.max(-60, Math.min(60, e.deltaY)) * 0.003));
    }, { passive: false });
    c.addEventListener("keydown", (e) => {
      const by: Record<string, [number, number]> = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] };
      const step = by[e.key];
      if (step) this.orbit(-step[0], -step[1]);
      else if (e.key === "+" || e.key === "=") this.near(0.9);
      else if (e.key === "-") this.near(1 / 0.9);
      else return;
      e.preventDefault();
    });
    $("space-in").addEventListener("click", () => this.near(0.8));
    $("space-out").addEventListener("click", () => this.near(1.25));
    $("space-reset").addEventListener("click", () => this.reset());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.refresh());
  }

  private orbit(dx: number, dy: number): void {
    const offset = turn(sub(this.eye, this.target), this.up, dx * this.hand);
    const high = Math.acos(Math.max(-1, Math.min(1, dot(unit(offset), this.up))));
    const by = Math.max(0.02, Math.min(Math.PI - 0.02, high - dy)) - high;
    this.eye = add(this.target, turn(offset, unit(cross(this.up, offset)), by));
    this.refresh();
  }

  private near(factor: number): void {
    this.eye = add(this.target, times(sub(this.eye, this.target), factor));
    this.refresh();
  }

  private pan(dx: number, dy: number): void {
    const [right, up] = this.axes();
    const scale = length(sub(this.eye, this.target)) / Math.max(1, this.canvas.clientHeight);
    const step = add(times(right, -dx * scale), times(up, dy * scale));
    this.eye = add(this.eye, step);
    this.target = add(this.target, step);
    this.refresh();
  }

  private axes(): [Vec3, Vec3, Vec3] {
    const forward = unit(sub(this.target, this.eye));
    const right = times(unit(cross(this.up, forward)), this.hand);
    return [right, times(cross(forward, right), this.hand), forward];
  }

  setScan(scan: Scan, camera: CameraState, up: Vec3): void {
    this.scan = scan;
    this.camera = camera;
    this.up = up;
    this.hand = dot(cross(camera.up, camera.forward), camera.right) < 0 ? -1 : 1;
    this.refresh();
  }

  setPaths(paths: PathTold[], chosen: number, look: boolean): void {
    this.paths = paths;
    this.chosen = chosen;
    if (look) this.reset();
    this.refresh();
  }

  /** Looks from behind and above the camera at where the paths are. */
  reset(): void {
    const camera = this.camera;
    if (!camera) return;
    const all = this.paths.flatMap((p) => segments(p, 0).points);
    const first = all[0] ?? add(camera.eye, times(camera.forward, camera.size / 3));
    const distance = Math.max(length(sub(first, camera.eye)), camera.size * 1e-3);
    const near = all.filter((p) => length(sub(p, first)) < distance * 1.5);
    const middle = near.length ? times(near.reduce(add, [0, 0, 0]), 1 / near.length) : first;
    this.target = add(camera.eye, times(sub(middle, camera.eye), 0.72));
    this.size = distance;
    const back = add(add(times(camera.forward, -0.75), times(this.up, 0.62)), times(camera.right, 0.95));
    this.eye = add(this.target, times(unit(back), distance * 1.25));
    this.refresh();
  }

  refresh(): void {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.draw();
    });
  }

  private draw(): void {
    const box = $("space-box").getBoundingClientRect();
    if (box.width < 2 || box.height < 2) return;
    const scale = devicePixelRatio || 1;
    const [W, H] = [Math.round(box.width * scale), Math.round(box.height * scale)];
    if (this.canvas.width !== W || this.canvas.height !== H) [this.canvas.width, this.canvas.height] = [W, H];
    const c = this.ink;
    const style = getComputedStyle(document.documentElement);
    const color = (name: string): string => style.getPropertyValue(name).trim();
    c.clearRect(0, 0, W, H);
    const [right, up, forward] = this.axes();
    const focal = 0.9 * H;
    const near = length(sub(this.eye, this.target)) * 0.02;
    /** Camera space. */
    const see = (p: Vec3): Vec3 => {
      const d = sub(p, this.eye);
      return [dot(d, right), dot(d, up), dot(d, forward)];
    };
    const flat = (v: Vec3): [number, number] => [W / 2 + (focal * v[0]) / v[2], H / 2 - (focal * v[1]) / v[2]];
    this.drawScan(c, see, flat, near, color("--k-grid"), color("--k-shadow"), scale);
    this.drawCamera(c, see, flat, near, color("--k-camera"), scale);
    const order = this.paths.map((_, i) => i).filter((i) => i !== this.chosen);
    if (this.chosen < this.paths.length) order.push(this.chosen);
    for (const i of order) {
      const chosen = i === this.chosen;
      const path = this.paths[i]!;
      const { segments: list, points, lamps } = segments(path, this.size * 0.6);
      c.globalAlpha = chosen ? 1 : 0.28;
      for (const s of list) {
        if (!chosen && (s.kind === "blocked" || s.kind === "shadow")) continue;
        let [a, b] = [see(s.from), see(s.to)];
        if (a[2] < near && b[2] < near) continue;
        if (a[2] < near) a = add(a, times(sub(b, a), (near - a[2]) / (b[2] - a[2])));
        if (b[2] < near) b = add(b, times(sub(a, b), (near - b[2]) / (a[2] - b[2])));
        const [p, q] = [flat(a), flat(b)];
        const dashed = s.kind === "shadow" || s.kind === "blocked";
        c.setLineDash(dashed ? [5 * scale, 4 * scale] : []);
        c.strokeStyle = color(COLORS[s.kind]);
        c.lineWidth = (chosen ? (dashed ? 1.8 : 2.6) : 1.1) * scale;
        c.beginPath();
        c.moveTo(p[0], p[1]);
        c.lineTo(q[0], q[1]);
        c.stroke();
        c.setLineDash([]);
        if (chosen && s.kind === "blocked") this.cross(c, q, color("--k-blocked"), scale);
        if (chosen && !dashed) this.arrow(c, p, q, color(COLORS[s.kind]), scale);
      }
      if (!chosen) continue;
      for (const lamp of lamps) {
        const v = see(lamp);
        if (v[2] > near) this.disc(c, flat(v), 4.5 * scale, color("--k-shadow"), color("--paper"));
      }
      points.forEach((point, k) => {
        const v = see(point);
        if (v[2] <= near) return;
        const at = flat(v);
        this.disc(c, at, 9 * scale, color("--ink"), color("--paper"));
        c.fillStyle = color("--paper");
        c.font = `600 ${11 * scale}px system-ui, sans-serif`;
        c.textAlign = "center";
        c.textBaseline = "middle";
        c.fillText(String(k + 1), at[0], at[1] + 0.5 * scale);
      });
    }
    c.globalAlpha = 1;
  }

  private drawScan(
    c: CanvasRenderingContext2D,
    see: (p: Vec3) => Vec3,
    flat: (v: Vec3) => [number, number],
    near: number,
    grid: string,
    lamp: string,
    scale: number,
  ): void {
    const scan = this.scan;
    if (!scan) return;
    const { columns, rows, points } = scan;
    const n = columns * rows;
    const screen = new Float32Array(n * 3);
    for (let i = 0; i < n; i++) {
      const x = points[6 * i]!;
      const v = Number.isNaN(x) ? null : see([x, points[6 * i + 1]!, points[6 * i + 2]!]);
      if (v && v[2] > near) {
        const p = flat(v);
        screen.set([p[0], p[1], v[2]], 3 * i);
      } else screen[3 * i + 2] = -1;
    }
    const space = (i: number): Vec3 => [points[6 * i]!, points[6 * i + 1]!, points[6 * i + 2]!];
    const eye = this.camera?.eye ?? this.eye;
    // Tens of thousands of short lines and points: drawn by hand, which is quicker than telling a canvas about each.
    const raster = new Raster(c.canvas.width, c.canvas.height);
    const faint = rgb(grid);
    const join = (i: number, k: number): void => {
      if (screen[3 * i + 2]! < 0 || screen[3 * k + 2]! < 0) return;
      const [a, b] = [length(sub(space(i), eye)), length(sub(space(k), eye))];
      // Neighbours in the picture are joined where they can be of one surface.
      if (Math.abs(a - b) > 0.06 * Math.min(a, b)) return;
      raster.line(screen[3 * i]!, screen[3 * i + 1]!, screen[3 * k]!, screen[3 * k + 1]!, faint, 150);
    };
    for (let y = 0; y < rows; y++) {
      for (let x = 0; x < columns; x++) {
        const i = y * columns + x;
        if (x + 1 < columns && y % 3 === 0) join(i, i + 1);
        if (y + 1 < rows && x % 3 === 0) join(i, i + columns);
      }
    }
    // Points in their own colours, so that one knows what is where; and those where light passes.
    const size = Math.max(1, Math.round(1.4 * scale));
    for (let i = 0; i < n; i++) {
      if (screen[3 * i + 2]! < 0) continue;
      const shade = (k: number): number => 255 * Math.min(1, Math.max(0, points[6 * i + k]!)) ** 0.45;
      raster.dot(screen[3 * i]!, screen[3 * i + 1]!, size, [shade(3), shade(4), shade(5)], 225);
    }
    const bright = rgb(lamp);
    for (let i = n; i < points.length / 6; i++) {
      const v = see(space(i));
      if (v[2] <= near) continue;
      const p = flat(v);
      const lit = points[6 * i + 3]! > 0.5;
      raster.dot(p[0], p[1], size, lit ? bright : faint, lit ? 230 : 140);
    }
    c.putImageData(raster.data, 0, 0);
  }

  private drawCamera(c: CanvasRenderingContext2D, see: (p: Vec3) => Vec3, flat: (v: Vec3) => [number, number], near: number, color: string, scale: number): void {
    const camera = this.camera;
    if (!camera) return;
    const d = this.size * 0.09;
    const h = Math.tan(((camera.fov ?? 40) * Math.PI) / 360) * d;
    const w = h * 1.5;
    const corner = (x: number, y: number): Vec3 => add(add(add(camera.eye, times(camera.forward, d)), times(camera.right, x * w)), times(camera.up, y * h));
    const all = [camera.eye, corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)].map(see);
    if (all.some((v) => v[2] < near)) return;
    const p = all.map(flat);
    c.strokeStyle = color;
    c.lineWidth = 1.5 * scale;
    c.beginPath();
    for (const i of [1, 2, 3, 4]) {
      c.moveTo(...p[0]!);
      c.lineTo(...p[i]!);
      c.lineTo(...p[(i % 4) + 1]!);
    }
    c.stroke();
  }

  private disc(c: CanvasRenderingContext2D, at: [number, number], r: number, fill: string, edge: string): void {
    c.beginPath();
    c.arc(at[0], at[1], r, 0, 7);
    c.fillStyle = fill;
    c.fill();
    c.strokeStyle = edge;
    c.lineWidth = r * 0.22;
    c.stroke();
  }

  private cross(c: CanvasRenderingContext2D, at: [number, number], color: string, scale: number): void {
    const r = 5 * scale;
    c.strokeStyle = color;
    c.lineWidth = 2 * scale;
    c.beginPath();
    c.moveTo(at[0] - r, at[1] - r);
    c.lineTo(at[0] + r, at[1] + r);
    c.moveTo(at[0] - r, at[1] + r);
    c.lineTo(at[0] + r, at[1] - r);
    c.stroke();
  }

  private arrow(c: CanvasRenderingContext2D, p: [number, number], q: [number, number], color: string, scale: number): void {
    const size = Math.hypot(q[0] - p[0], q[1] - p[1]);
    if (size < 60 * scale) return;
    const [dx, dy] = [(q[0] - p[0]) / size, (q[1] - p[1]) / size];
    const [x, y] = [(p[0] + q[0]) / 2, (p[1] + q[1]) / 2];
    const r = 6 * scale;
    c.fillStyle = color;
    c.beginPath();
    c.moveTo(x + dx * r, y + dy * r);
    c.lineTo(x - dx * r - dy * r * 0.7, y - dy * r + dx * r * 0.7);
    c.lineTo(x - dx * r + dy * r * 0.7, y - dy * r - dx * r * 0.7);
    c.fill();
  }
}
