/** The pictures on their canvas: where they lie, how large they are, and what pointers and keys do to them. */

import { $ } from "./dom.ts";
import { makeDisplay, type Display, type Look, type Place, type What } from "./display.ts";
import type { Picture } from "./picture.ts";
import type { Plane } from "./protocol.ts";
import { half } from "./tone.ts";

export type Tool = "orbit" | "inspect" | "focus";

export interface Shown {
  picture: Picture;
  what: What;
  plane: Plane | null;
  range: Place["range"];
  reference: Plane | null;
  look: Look;
  label: string;
}

export interface Hands {
  /** Moves begin: what is there now can be had back. */
  grab(): void;
  orbit(dx: number, dy: number): void;
  pan(dx: number, dy: number): void;
  dolly(factor: number): void;
  pick(pane: number, x: number, y: number): void;
  focus(pane: number, x: number, y: number): void;
  hover(pane: number, x: number, y: number): void;
}

interface Spot {
  pane: number;
  x: number;
  y: number;
}

export class Viewport {
  tool: Tool = "orbit";
  /** The marked pixel. */
  mark: Spot | null = null;
  split: number | null = null;
  private readonly canvas = $<HTMLCanvasElement>("canvas");
  private readonly overlay = $<HTMLCanvasElement>("overlay");
  private readonly ink: CanvasRenderingContext2D;
  readonly display: Display;
  private shown: Shown[] = [];
  /** Device pixels for one of the picture; null fits it in. */
  private zoom: number | null = null;
  /** The middle of what is seen, as a part of the picture. */
  private centre: [number, number] = [0.5, 0.5];
  private readonly pointers = new Map<number, { x: number; y: number; startX: number; startY: number }>();
  private moved = false;
  private waiting = false;
  /** Called when what has come is on the screen. */
  drawn: () => void = () => {};

  constructor(private readonly hands: Hands, plain: boolean) {
    this.display = makeDisplay(this.canvas, plain);
    this.ink = this.overlay.getContext("2d", { willReadFrequently: true })!;
    new ResizeObserver(() => this.resize()).observe($("pictures"));
    this.listen();
    this.resize();
  }

  show(shown: Shown[]): void {
    this.shown = shown;
    this.refresh();
  }

  refresh(): void {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.draw();
      this.drawn();
    });
  }

  private resize(): void {
    const box = $("pictures").getBoundingClientRect();
    const scale = devicePixelRatio || 1;
    for (const c of [this.canvas, this.overlay]) {
      c.width = Math.max(1, Math.round(box.width * scale));
      c.height = Math.max(1, Math.round(box.height * scale));
    }
    this.draw();
  }

  private places(): Place[] {
    const [W, H] = [this.canvas.width, this.canvas.height];
    const n = Math.max(1, this.shown.length);
    const across = W >= H;
    return this.shown.map((s, i) => {
      const rect = across
        ? { x: Math.round((W * i) / n), y: 0, width: Math.round(W / n), height: H }
        : { x: 0, y: Math.round((H * i) / n), width: W, height: Math.round(H / n) };
      const p = s.picture;
      const zoom = this.zoomIn(rect, p);
      const origin: [number, number] = [
        rect.x + rect.width / 2 - this.centre[0] * p.width * zoom,
        rect.y + rect.height / 2 - this.centre[1] * p.height * zoom,
      ];
      // Pixels lie on pixels where that can be.
      if (zoom >= 1) origin.forEach((v, k) => (origin[k] = Math.round(v)));
      const split = this.split === null ? null : Math.round(origin[0] + this.split * p.width * zoom);
      return { ...s, rect, zoom, origin, split };
    });
  }

  private zoomIn(rect: { width: number; height: number }, p: Picture): number {
    const fit = Math.min(rect.width / Math.max(1, p.width), rect.height / Math.max(1, p.height));
    return this.zoom ?? (fit > 0 ? fit : 1);
  }

  private draw(): void {
    const places = this.places();
    this.display.draw(places, this.canvas.width, this.canvas.height);
    this.annotate(places);
  }

  private annotate(places: Place[]): void {
    const c = this.ink;
    const scale = devicePixelRatio || 1;
    c.clearRect(0, 0, this.overlay.width, this.overlay.height);
    c.font = `${12 * scale}px system-ui, sans-serif`;
    places.forEach((place, pane) => {
      const { rect, origin, zoom, picture } = place;
      c.save();
      c.beginPath();
      c.rect(rect.x, rect.y, rect.width, rect.height);
      c.clip();
      if (zoom >= 56 * scale) this.values(place);
      if (place.split !== null && place.reference) {
        c.fillStyle = "#fff";
        c.fillRect(place.split - scale, origin[1], 2 * scale, picture.height * zoom);
      }
      if (this.mark && this.mark.pane === pane) {
        const [x, y] = [origin[0] + (this.mark.x + 0.5) * zoom, origin[1] + (this.mark.y + 0.5) * zoom];
        const r = Math.max(zoom / 2 + 2 * scale, 7 * scale);
        for (const [width, color] of [[4, "rgb(0 0 0 / .75)"], [1.75, "#fff"]] as const) {
          c.lineWidth = width * scale;
          c.strokeStyle = color;
          c.beginPath();
          c.rect(x - r, y - r, 2 * r, 2 * r);
          for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]] as const) {
            c.moveTo(x + dx * r, y + dy * r);
            c.lineTo(x + dx * (r + 6 * scale), y + dy * (r + 6 * scale));
          }
          c.stroke();
        }
      }
      const label = this.shown[pane]!.label;
      if (label) {
        const w = c.measureText(label).width + 16 * scale;
        const [x, y] = [rect.x + rect.width / 2 - w / 2, rect.y + rect.height - 34 * scale];
        c.fillStyle = "rgb(0 0 0 / .7)";
        c.beginPath();
        c.roundRect(x, y, w, 22 * scale, 5 * scale);
        c.fill();
        c.fillStyle = "#fff";
        c.fillText(label, x + 8 * scale, y + 15.5 * scale);
      }
      c.restore();
      if (pane > 0) {
        c.fillStyle = "rgb(128 128 128 / .8)";
        if (rect.x > 0) c.fillRect(rect.x - scale, 0, 2 * scale, rect.height);
        else c.fillRect(0, rect.y - scale, rect.width, 2 * scale);
      }
    });
  }

  /** Numbers in pixels that are large enough for them. */
  private values({ origin, zoom, picture, rect }: Place): void {
    const c = this.ink;
    const size = Math.min(13 * devicePixelRatio, zoom / 5.5);
    c.font = `${size}px ui-monospace, monospace`;
    const from = [0, 1].map((k) => Math.max(0, Math.floor(((k ? rect.y : rect.x) - origin[k]!) / zoom)));
    const to = [0, 1].map((k) => Math.min(k ? picture.height : picture.width, Math.ceil(((k ? rect.y + rect.height : rect.x + rect.width) - origin[k]!) / zoom)));
    for (let y = from[1]!; y < to[1]!; y++) {
      for (let x = from[0]!; x < to[0]!; x++) {
        const v = picture.pixel(x, y);
        if (!v) continue;
        const dark = 0.2126 * v[0] + 0.7152 * v[1] + 0.0722 * v[2] < 0.3;
        c.fillStyle = dark ? "#fff" : "#000";
        [0, 1, 2].forEach((k) => c.fillText(v[k]!.toPrecision(3), origin[0] + x * zoom + size * 0.4, origin[1] + y * zoom + size * (1.4 + 1.25 * k)));
      }
    }
  }

  /** The pixel under a place of the page. */
  private spot(clientX: number, clientY: number): Spot | null {
    const box = this.overlay.getBoundingClientRect();
    const scale = this.overlay.width / Math.max(1, box.width);
    const [x, y] = [(clientX - box.left) * scale, (clientY - box.top) * scale];
    const pane = this.places().findIndex(({ rect }) => x >= rect.x && x < rect.x + rect.width && y >= rect.y && y < rect.y + rect.height);
    const place = this.places()[pane];
    if (!place) return null;
    const px = Math.floor((x - place.origin[0]) / place.zoom);
    const py = Math.floor((y - place.origin[1]) / place.zoom);
    const inside = px >= 0 && py >= 0 && px < place.picture.width && py < place.picture.height;
    return inside ? { pane, x: px, y: py } : null;
  }

  /** Where on the page a pixel is. */
  at(pane: number, x: number, y: number): [number, number] {
    const place = this.places()[pane]!;
    const box = this.overlay.getBoundingClientRect();
    const scale = this.overlay.width / Math.max(1, box.width);
    return [box.left + (place.origin[0] + (x + 0.5) * place.zoom) / scale, box.top + (place.origin[1] + (y + 0.5) * place.zoom) / scale];
  }

  // --- Zoom ---

  fit(): void {
    this.zoom = null;
    this.centre = [0.5, 0.5];
    this.refresh();
  }

  one(): void {
    this.zoom = devicePixelRatio || 1;
    this.refresh();
  }

  /** Zooms by a factor, keeping what is under a place of the page where it is. */
  zoomBy(factor: number, clientX?: number, clientY?: number): void {
    const place = this.places()[0];
    if (!place) return;
    const before = place.zoom;
    const next = Math.min(256, Math.max(0.05, before * factor));
    const box = this.overlay.getBoundingClientRect();
    const scale = this.overlay.width / Math.max(1, box.width);
    const all = this.places();
    const at = clientX === undefined ? null : [(clientX - box.left) * scale, ((clientY ?? 0) - box.top) * scale];
    const under = at ? (all.find(({ rect }) => at[0]! >= rect.x && at[0]! < rect.x + rect.width) ?? place) : place;
    const middle = [under.rect.x + under.rect.width / 2, under.rect.y + under.rect.height / 2];
    const fixed = at ?? middle;
    const size = [under.picture.width, under.picture.height];
    for (const k of [0, 1] as const) {
      const held = (fixed[k]! - under.origin[k]) / before;
      this.centre[k] = (held - (fixed[k]! - middle[k]!) / next) / Math.max(1, size[k]!);
    }
    this.zoom = next;
    this.bound();
    this.refresh();
  }

  private bound(): void {
    this.centre = this.centre.map((v) => Math.min(1, Math.max(0, v))) as [number, number];
  }

  private shift(dx: number, dy: number): void {
    const place = this.places()[0];
    if (!place) return;
    this.zoom = place.zoom;
    const scale = devicePixelRatio || 1;
    this.centre[0] -= (dx * scale) / (place.zoom * place.picture.width);
    this.centre[1] -= (dy * scale) / (place.zoom * place.picture.height);
    this.bound();
    this.refresh();
  }

  // --- Hands ---

  private listen(): void {
    const o = this.overlay;
    o.addEventListener("contextmenu", (e) => e.preventDefault());
    o.addEventListener("pointerdown", (e) => {
      o.setPointerCapture(e.pointerId);
      o.focus({ preventScroll: true });
      this.pointers.set(e.pointerId, { x: e.clientX, y: e.clientY, startX: e.clientX, startY: e.clientY });
      if (this.pointers.size === 1) {
        this.moved = false;
        this.hands.grab();
      } else this.moved = true;
    });
    o.addEventListener("pointermove", (e) => {
      const spot = this.spot(e.clientX, e.clientY);
      if (spot) this.hands.hover(spot.pane, spot.x, spot.y);
      const p = this.pointers.get(e.pointerId);
      if (p) this.drag(e, p);
    });
    const up = (e: PointerEvent): void => {
      const p = this.pointers.get(e.pointerId);
      this.pointers.delete(e.pointerId);
      if (!p || this.moved || e.type === "pointercancel") return;
      const spot = this.spot(e.clientX, e.clientY);
      if (spot && this.tool === "inspect") this.pick(spot);
      if (spot && this.tool === "focus") this.hands.focus(spot.pane, spot.x, spot.y);
    };
    o.addEventListener("pointerup", up);
    o.addEventListener("pointercancel", up);
    o.addEventListener("dblclick", (e) => {
      const spot = this.spot(e.clientX, e.clientY);
      if (spot && this.tool === "orbit") this.hands.focus(spot.pane, spot.x, spot.y);
    });
    o.addEventListener(
      "wheel",
      (e) => {
        e.preventDefault();
        const by = Math.exp(Math.max(-60, Math.min(60, e.deltaY * (e.deltaMode ? 16 : 1))) * 0.0022);
        if (e.ctrlKey || this.tool !== "orbit") this.zoomBy(1 / (by * by), e.clientX, e.clientY);
        else {
          this.hands.grab();
          this.hands.dolly(by);
        }
      },
      { passive: false },
    );
    o.addEventListener("keydown", (e) => this.key(e));
  }

  private pick(spot: Spot): void {
    this.mark = spot;
    this.refresh();
    this.hands.pick(spot.pane, spot.x, spot.y);
  }

  private drag(e: PointerEvent, p: { x: number; y: number; startX: number; startY: number }): void {
    const [dx, dy] = [e.clientX - p.x, e.clientY - p.y];
    if (!this.moved && Math.hypot(e.clientX - p.startX, e.clientY - p.startY) < 4) return;
    this.moved = true;
    const box = this.overlay.getBoundingClientRect();
    if (this.pointers.size === 2) {
      const other = [...this.pointers.entries()].find(([id]) => id !== e.pointerId)?.[1];
      if (!other) return;
      const before = Math.hypot(p.x - other.x, p.y - other.y);
      const after = Math.hypot(e.clientX - other.x, e.clientY - other.y);
      [p.x, p.y] = [e.clientX, e.clientY];
      if (this.tool === "orbit") {
        if (before > 0 && after > 0) this.hands.dolly(before / after);
        this.hands.pan((-0.5 * dx) / box.height, (0.5 * dy) / box.height);
      } else {
        if (before > 0) this.zoomBy(after / before, (e.clientX + other.x) / 2, (e.clientY + other.y) / 2);
        this.shift(dx / 2, dy / 2);
      }
      return;
    }
    [p.x, p.y] = [e.clientX, e.clientY];
    if (this.tool !== "orbit") this.shift(dx, dy);
    else if (e.shiftKey || (e.buttons & 6) !== 0) this.hands.pan(-dx / box.height, dy / box.height);
    else this.hands.orbit((dx / box.height) * 3, (dy / box.height) * 3);
  }

  private key(e: KeyboardEvent): void {
    const step: Record<string, [number, number]> = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const by = step[e.key];
    if (e.ctrlKey || e.metaKey || e.altKey) return;
    if (this.tool !== "orbit" && (by || e.key === "Enter")) {
      e.preventDefault();
      const picture = this.shown[this.mark?.pane ?? 0]?.picture;
      if (!picture) return;
      const mark = this.mark ?? { pane: 0, x: picture.width >> 1, y: picture.height >> 1 };
      const far = e.shiftKey ? 10 : 1;
      if (by) {
        mark.x = Math.min(picture.width - 1, Math.max(0, mark.x + by[0] * far));
        mark.y = Math.min(picture.height - 1, Math.max(0, mark.y + by[1] * far));
        this.hands.hover(mark.pane, mark.x, mark.y);
      } else if (this.tool === "inspect") this.hands.pick(mark.pane, mark.x, mark.y);
      else this.hands.focus(mark.pane, mark.x, mark.y);
      this.mark = mark;
      this.refresh();
      return;
    }
    if (by && e.shiftKey) this.act(e, () => this.hands.pan(0.04 * by[0], -0.04 * by[1]));
    else if (by) this.act(e, () => this.hands.orbit(-0.06 * by[0], -0.06 * by[1]));
    else if (e.key === "+" || e.key === "=") this.act(e, () => (this.tool === "orbit" ? this.hands.dolly(0.92) : this.zoomBy(1.25)));
    else if (e.key === "-") this.act(e, () => (this.tool === "orbit" ? this.hands.dolly(1 / 0.92) : this.zoomBy(0.8)));
  }

  private act(e: KeyboardEvent, what: () => void): void {
    e.preventDefault();
    this.hands.grab();
    what();
  }
}

/** The range of a plane's numbers where there is anything. */
export function rangeOf(plane: Plane): [number, number] {
  let [low, high] = [Infinity, -Infinity];
  for (let i = 0; i < plane.texels.length; i += 4) {
    if (half(plane.texels[i + 3]!) < 0.5) continue;
    const v = half(plane.texels[i]!);
    low = Math.min(low, v);
    high = Math.max(high, v);
  }
  // What is far behind everything else shall not take all colours.
  return low < high ? [low, Math.min(high, low + (high - low))] : [0, 1];
}
