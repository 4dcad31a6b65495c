/** The camera as one moves it: around a point, sideways, nearer, and the options of the command line that say where it is. */

import type { CameraState, Options, Vec3 } from "./protocol.ts";

export const add = (a: Vec3, b: Vec3): Vec3 => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const sub = (a: Vec3, b: Vec3): Vec3 => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const times = (a: Vec3, s: number): Vec3 => [a[0] * s, a[1] * s, a[2] * s];
export const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a: Vec3, b: Vec3): Vec3 => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
export const length = (a: Vec3): number => Math.hypot(a[0], a[1], a[2]);
export const unit = (a: Vec3): Vec3 => times(a, 1 / Math.max(length(a), 1e-30));

/** Turns `v` about a unit axis. */
export function turn(v: Vec3, axis: Vec3, angle: number): Vec3 {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return add(add(times(v, c), times(cross(axis, v), s)), times(axis, dot(axis, v) * (1 - c)));
}

/** As short as a number can be without moving the camera visibly. */
const short = (v: number): string => String(Number(v.toPrecision(7)));

export class Camera {
  eye: Vec3 = [0, 0, -5];
  /** What it turns around. */
  target: Vec3 = [0, 0, 0];
  /** The world's up. */
  up: Vec3 = [0, 1, 0];
  right: Vec3 = [1, 0, 0];
  /** The size of the scene, for steps. */
  size = 1;
  mirrored = false;

  /** Takes over what the server says. `distance` is how far what lies in the middle is, where that is known. */
  adopt(state: CameraState, options: Options, distance: number | null): void {
    this.size = state.size;
    this.eye = state.eye;
    this.right = state.right;
    this.mirrored = dot(cross(state.up, state.forward), state.right) < 0;
    const typed = options["look-at"]?.split(",").map(Number);
    if (typed?.length === 9 && typed.every(Number.isFinite)) {
      this.target = typed.slice(3, 6) as Vec3;
      this.up = unit(typed.slice(6) as Vec3);
      return;
    }
    const focus = state.focal_distance * state.scale;
    const far = distance ?? (focus < state.size * 4 ? focus : state.size * 0.5);
    this.target = add(state.eye, times(state.forward, Math.max(far, state.size * 1e-4)));
    // A camera that stands level turns about an axis of the world; one that does not, about its own.
    const axes: Vec3[] = [0, 1, 2].map((i) => [0, 1, 2].map((k) => (k === i ? 1 : 0)) as Vec3);
    const level = axes
      .flatMap((a) => [a, times(a, -1)])
      .filter((a) => Math.abs(dot(a, state.right)) < 1e-3 && dot(a, state.up) > 0.2)
      .sort((a, b) => dot(b, state.up) - dot(a, state.up))[0];
    this.up = level ?? state.up;
  }

  get forward(): Vec3 {
    return unit(sub(this.target, this.eye));
  }

  get distance(): number {
    return length(sub(this.target, this.eye));
  }

  private get side(): Vec3 {
    const side = unit(cross(this.up, this.forward));
    return this.mirrored ? times(side, -1) : side;
  }

  orbit(dx: number, dy: number): void {
    const sign = this.mirrored ? -1 : 1;
    const offset = turn(sub(this.eye, this.target), this.up, sign * dx);
    const high = Math.acos(Math.max(-1, Math.min(1, dot(unit(offset), this.up))));
    // Not over the poles. About this axis, angles from the pole grow.
    const by = Math.max(0.02, Math.min(Math.PI - 0.02, high - dy)) - high;
    this.eye = add(this.target, turn(offset, unit(cross(this.up, offset)), by));
  }

  /** Looks around from where it stands. */
  look(dx: number, dy: number): void {
    const ahead = sub(this.target, this.eye);
    const turned = turn(ahead, this.up, dx);
    const axis = unit(cross(this.up, turned));
    const next = turn(turned, axis, dy);
    if (Math.abs(dot(unit(next), this.up)) < 0.9995) this.target = add(this.eye, next);
  }

  /** Sideways and up, in units of the distance. */
  pan(dx: number, dy: number): void {
    const up = unit(cross(this.forward, unit(cross(this.up, this.forward))));
    const step = add(times(this.side, dx * this.distance), times(up, dy * this.distance));
    this.eye = add(this.eye, step);
    this.target = add(this.target, step);
  }

  /** Nearer by this factor below one, farther above. */
  dolly(factor: number): void {
    const least = this.size * 1e-5;
    const away = times(sub(this.eye, this.target), factor);
    if (length(away) > least) this.eye = add(this.target, away);
  }

  /** Walks along the view, the target too. */
  walk(step: number): void {
    const along = times(this.forward, step * this.distance);
    this.eye = add(this.eye, along);
    this.target = add(this.target, along);
  }

  get typed(): string {
    return [...this.eye, ...this.target, ...this.up].map(short).join(",");
  }
}
