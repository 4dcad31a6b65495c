/** The page: what the server says, what hands do, and what is drawn. */

import "./style.css";
import * as address from "./address.ts";
import { Camera } from "./camera.ts";
import { $, bytes, copy, digits, duration, el, save, svg, toast } from "./dom.ts";
import { makeDisplay, type Look, type What } from "./display.ts";
import { Explorer } from "./explorer.ts";
import { Link } from "./link.ts";
import { OF_THE_CAMERA, optionFields } from "./options.ts";
import { Picture, planeMean, planePixel } from "./picture.ts";
import { PROTOCOL, type CoarseFrame, type Explored, type Options, type PathTold, type Plane, type Probed, type Progress, type State, type TileFrame, type Told } from "./protocol.ts";
import { Space } from "./space.ts";
import { CURVES, luminance, whiteBalance, type Curve } from "./tone.ts";
import { Viewport, rangeOf, type Shown, type Tool } from "./viewport.ts";

const FEATURES = ["normal", "albedo", "depth", "uv", "position", "material", "object", "motion"];
const IDENTITY: Look["toSrgb"] = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
const query = new URLSearchParams(location.search);

class Page {
  private state: State | null = null;
  private progress: Progress | null = null;
  private readonly pictures = [new Picture(), new Picture()];
  private readonly camera = new Camera();
  private options: Options[] = [{}];
  /** The side that settings are of. */
  private side = 0;
  private what = "light";
  private curve: Curve = "agx";
  private exposure = 0;
  private kelvin = 6500;
  private tint = 0;
  private falseColor = false;
  private readonly features = new Map<string, Plane>();
  private reference: Plane | null = null;
  private compare: "off" | "slider" | "difference" | "flip" = "off";
  private flip: Plane | null = null;
  private flipOf = -1;
  private flipBusy = false;
  private readonly undos: string[] = [];
  private grabbed = "";
  private sentAt = 0;
  private sending = false;
  private explored: { pane: number; x: number; y: number } | null = null;
  private scanOf = -1;
  private histogramAt = 0;
  private shutterLength = 1;
  private readonly viewport: Viewport;
  private readonly space = new Space();
  private readonly explorer: Explorer;
  private readonly link: Link;
  private readonly first = address.read(location.hash);
  private begun = false;
  /** The camera is the scene's again, and where that is comes with the next state. */
  private stale = false;
  /** The newest frame that has come, and that the server knows of. */
  private taken = 0;
  private acknowledged = 0;

  constructor() {
    this.viewport = new Viewport(
      {
        grab: () => this.grab(),
        orbit: (dx, dy) => this.move(() => this.camera.orbit(dx, dy)),
        pan: (dx, dy) => this.move(() => this.camera.pan(dx, dy)),
        dolly: (factor) => this.move(() => this.camera.dolly(factor)),
        pick: (pane, x, y) => void this.explore(pane, x, y),
        focus: (pane, x, y) => void this.focus(pane, x, y),
        hover: (pane, x, y) => this.hover(pane, x, y),
      },
      query.get("canvas") === "2d",
    );
    this.explorer = new Explorer({
      show: (paths, chosen) => this.space.setPaths(paths, chosen, false),
      path: (sample) => this.link.ask<PathTold>({ type: "path", pane: this.explored?.pane ?? 0, pixel: this.pixelOf(), sample }),
      close: () => this.closeExplorer(),
    });
    this.viewport.drawn = () => {
      if (this.taken === this.acknowledged) return;
      this.acknowledged = this.taken;
      this.link.say({ type: "ack", frame: this.taken });
    };
    this.applyLook(this.first?.look ?? {});
    this.wire();
    this.link = new Link(query.get("token") ?? "", {
      told: (message) => this.told(message),
      frame: (frame) => this.frame(frame),
      connection: (how) => this.connection(how),
    });
  }

  // --- From the server ---

  private connection(how: "open" | "lost" | "dead"): void {
    document.body.dataset["connection"] = how;
    if (how === "open") {
      this.alert();
      // What it has of the pictures may be of another run.
      for (const p of this.pictures) p.generation = -1;
      [this.taken, this.acknowledged] = [0, 0];
      return;
    }
    const text = how === "dead" ? "The server does not let this page in, or has gone. Open the address that `steradian view` prints." : "The connection is lost; trying again …";
    $("alert-text").textContent = text;
    $("alert").hidden = false;
  }

  private told(message: Told): void {
    switch (message.type) {
      case "hello":
        $("scene").textContent = message.scene;
        document.title = `${message.scene} – Steradian`;
        if (message.protocol !== PROTOCOL) toast("The server is of another version; please load the page again");
        break;
      case "state":
        this.adopt(message);
        break;
      case "progress":
        this.progress = message;
        this.showProgress();
        break;
      case "refusal":
        toast(message.why);
        break;
    }
  }

  private frame(frame: CoarseFrame | TileFrame): void {
    const picture = this.pictures[frame.pane];
    // Only what has been drawn has been taken in: a slow page, or one that nobody looks at, is sent less.
    this.taken = frame.frame;
    if (!picture) return;
    const changed = picture.generation !== frame.generation;
    picture.take(frame);
    if (changed && frame.pane === (this.explored?.pane ?? 0)) this.features.clear();
    if (changed && FEATURES.includes(this.what)) void this.fetchFeature();
    document.body.dataset["frames"] = String(Number(document.body.dataset["frames"] ?? 0) + 1);
    this.redraw();
    if (performance.now() - this.histogramAt > 300) this.histogram();
  }

  private adopt(state: State): void {
    const before = this.state;
    this.state = state;
    if (!this.begun && state.panes.length > 0) {
      this.begun = true;
      const kept = this.first?.panes ?? [];
      this.options = state.panes.map((p) => ({ ...p.options }));
      if (kept[0]) this.options[0] = kept[0];
      if (kept[1]) {
        this.options[1] = kept[1];
        this.link.say({ type: "compare", options: kept[1] });
      }
      if (kept[0]) this.send();
      void this.findPivot();
    }
    if (this.answers(state)) this.takeOptions(state);
    // Whatever became of what was said, in the end the server's word holds.
    else setTimeout(() => this.state === state && !this.sending && this.takeOptions(state), 5000);
    if (state.panes.length !== before?.panes.length) {
      if (state.panes.length < 2) this.side = 0;
      this.pictures[1] = new Picture();
    }
    this.alert();
    if (state.reference?.stamp !== before?.reference?.stamp) void this.fetchReference();
    this.fill();
    this.redraw();
  }

  /** Whether a state is of after what this page said last; older ones would undo it. */
  private answers(state: State): boolean {
    if (this.sending) return false;
    if (state.refused !== null || performance.now() - this.sentAt > 5000) return true;
    const same = (options: Options, i: number): boolean => Object.entries(options).every(([name, value]) => state.panes[i]?.options[name] === value);
    const names = (options: Options | undefined): string => Object.keys(options ?? {}).filter((n) => n !== "sampler").sort().join();
    return state.panes.length === this.options.length && this.options.every((o, i) => same(o, i) && names(o) === names(state.panes[i]?.options));
  }

  private takeOptions(state: State): void {
    const next = state.panes.map((p) => p.options);
    if (state.refused === null && JSON.stringify(next) !== JSON.stringify(this.options)) {
      this.options = next.map((o) => ({ ...o }));
      const camera = state.panes[0]?.camera;
      if (camera) this.camera.adopt(camera, this.options[0]!, null);
      this.fill();
    }
    if (this.stale) {
      this.stale = false;
      void this.findPivot();
    }
    this.keepAddress();
  }

  /** The camera turns around what lies in the middle of the picture. */
  private async findPivot(): Promise<void> {
    const pane = this.state?.panes[0];
    if (!pane) return;
    this.camera.adopt(pane.camera, pane.options, null);
    if (pane.camera.shutter[1] > pane.camera.shutter[0]) this.shutterLength = pane.camera.shutter[1] - pane.camera.shutter[0];
    const pixel = pane.size.map((n, i) => pane.origin[i]! + (n >> 1));
    const found = await this.link.ask<Probed | null>({ type: "probe", pane: 0, pixel }).catch(() => null);
    if (found && !this.options[0]!["look-at"]) this.camera.adopt(pane.camera, pane.options, found.depth);
  }

  private alert(): void {
    const words = [...(this.state?.problems ?? []), ...(this.state?.refused ? [this.state.refused] : [])].join("\n");
    $("alert-text").textContent = words;
    $("alert").hidden = words === "";
  }

  private showProgress(): void {
    const p = this.progress;
    const pane = p?.panes[0];
    if (!p || !pane) return;
    const goal = this.state?.goal;
    const bits = [
      `<b>${pane.spp < 10 && pane.spp % 1 > 0.05 ? pane.spp.toFixed(1) : Math.floor(pane.spp + 1e-6)}</b> spp`,
      duration(pane.seconds),
      `${pane.mrays.toFixed(1)} Mrays/s`,
      pane.error === null ? "" : `error ${digits(100 * pane.error, 2)} %`,
      p.memory === null ? "" : bytes(p.memory),
    ].filter(Boolean);
    const words = this.state?.paused ? "paused" : pane.finished ? "done" : "";
    const line = $("numbers");
    line.replaceChildren();
    bits.concat(words).filter(Boolean).forEach((bit, i) => {
      if (i > 0) line.append("  ·  ");
      const bold = /^<b>(.*)<\/b>(.*)$/.exec(bit);
      if (bold) line.append(el("b", {}, bold[1]!), bold[2]!);
      else line.append(bit);
    });
    let fraction = goal?.spp ? pane.spp / goal.spp : 0;
    if (goal?.error && pane.error) fraction = Math.max(fraction, (goal.error / pane.error) ** 2);
    $<HTMLProgressElement>("progress").value = pane.finished ? 1 : Math.min(1, fraction);
    document.body.dataset["spp"] = String(pane.spp);
    document.body.dataset["latency"] = String(pane.latency_ms ?? "");
    if (p.panes.length > 1) this.redraw();
  }

  // --- What is drawn ---

  private get look(): Look {
    return {
      curve: this.curve,
      exposure: this.exposure,
      gains: whiteBalance(this.kelvin, this.tint),
      falseColor: this.falseColor,
      toSrgb: this.state?.panes[0]?.to_srgb ?? IDENTITY,
    };
  }

  private redraw(): void {
    const n = Math.max(1, this.state?.panes.length ?? 1);
    const shown: Shown[] = [];
    for (let pane = 0; pane < n; pane++) {
      const state = this.state?.panes[pane];
      let look = this.look;
      // Numbers are no light: no curve changes them.
      if (state?.raw) look = { ...look, curve: "clip", exposure: 0, gains: [1, 1, 1], falseColor: false, toSrgb: IDENTITY };
      let what: What = FEATURES.includes(this.what) ? "feature" : (this.what as What);
      let plane = what === "feature" ? (this.features.get(`${this.what}${pane}`) ?? null) : null;
      if (this.compare === "difference" && this.reference) what = "difference";
      if (this.compare === "flip" && this.flip && pane === 0) [what, plane] = ["flip", this.flip];
      const range = this.what === "albedo" ? "light" : this.what === "depth" && plane ? rangeOf(plane) : "colors";
      shown.push({ picture: this.pictures[pane]!, what, plane, range, reference: this.reference, look, label: n > 1 ? this.label(pane) : "" });
    }
    this.viewport.split = this.compare === "slider" && this.reference ? Number($<HTMLInputElement>("split").value) : null;
    $("stage").classList.toggle("two", n > 1);
    this.viewport.show(shown);
    this.showScale();
  }

  private label(pane: number): string {
    const p = this.progress?.panes[pane];
    const state = this.state?.panes[pane];
    if (!p || !state) return "";
    const other = this.progress?.panes[1 - pane];
    const gain = p.error && other?.error && p.error < other.error ? ` · ${digits((other.error / p.error) ** 2, 2)}× as efficient` : "";
    return `${state.integrator} · ${Math.floor(p.spp)} spp · ${duration(p.seconds)}${p.error === null ? "" : ` · error ${digits(100 * p.error, 2)} %`}${gain}`;
  }

  private showScale(): void {
    const box = $("scale");
    const ends: Record<string, [string, string]> = { error: ["0.1 %", "100 %"], samples: ["0", "most"] };
    let pair = ends[this.what];
    if (this.what === "depth") {
      const plane = this.features.get("depth0");
      const range = plane ? rangeOf(plane) : null;
      if (range) pair = [digits(range[0]), digits(range[1])];
    }
    if (this.falseColor && this.what === "light") pair = ["−7 EV", "+7 EV"];
    box.hidden = !pair;
    box.classList.toggle("reversed", this.what === "depth");
    if (pair) [$("scale-low").textContent, $("scale-high").textContent] = pair;
  }

  private histogram(): void {
    this.histogramAt = performance.now();
    const p = this.pictures[0]!;
    if (p.width === 0) return;
    const bins = new Float64Array(64);
    const scale = 2 ** this.exposure;
    const step = Math.max(1, Math.floor(Math.sqrt((p.width * p.height) / 40_000)));
    for (let y = 0; y < p.height; y += step) {
      for (let x = 0; x < p.width; x += step) {
        const v = p.pixel(x, y);
        if (!v) continue;
        const stops = Math.log2(Math.max(luminance([v[0], v[1], v[2]]) * scale, 1e-9) / 0.18);
        const bin = Math.floor(((stops + 10) / 16) * 64);
        if (bin >= 0) bins[Math.min(63, bin)]! += 1;
      }
    }
    const most = Math.max(...bins, 1);
    const d = [...bins].map((n, i) => `M${i * 5 + 0.5} 76V${(76 - 72 * Math.sqrt(n / most)).toFixed(1)}h4V76z`).join("");
    const marks = [-8, -4, 0, 4].map((s) => svg("text", { x: ((s + 10) / 16) * 320, y: 87, "text-anchor": "middle" }, s > 0 ? `+${s}` : String(s)));
    const grey = (10 / 16) * 320;
    $("histogram").replaceChildren(
      svg("line", { x1: grey, x2: grey, y1: 2, y2: 76, stroke: "var(--line)" }),
      svg("path", { d, fill: "var(--accent)" }),
      ...marks,
    );
  }

  private hover(pane: number, x: number, y: number): void {
    const picture = this.pictures[pane];
    const v = picture?.pixel(x, y);
    if (!v) return;
    const origin = this.state?.panes[pane]?.origin ?? [0, 0];
    const place = `${x + origin[0]}, ${y + origin[1]}`;
    const shown = FEATURES.includes(this.what) ? this.features.get(`${this.what}${pane}`) : null;
    const values = shown ? planePixel(shown, x, y) : null;
    if (values) {
      $("readout").textContent = `${place}   ${this.what} ${values.map((c) => digits(c, 4)).join(" ")}`;
      return;
    }
    const sure = v[4] > 1 && v[3] < 5e4 ? `  ± ${digits(100 * v[3], 2)} %` : "";
    const other = this.reference ? planePixel(this.reference, x, y) : null;
    const versus = other && this.compare !== "off" ? `   reference ${other.map((c) => digits(c, 4)).join(" ")}` : "";
    $("readout").textContent = `${place}   ${v.slice(0, 3).map((c) => digits(c, 4)).join(" ")}${sure}   ${v[4] || "< 1"} spp${versus}`;
  }

  private async fetchFeature(): Promise<void> {
    const name = this.what;
    for (let pane = 0; pane < (this.state?.panes.length ?? 1); pane++) {
      try {
        const plane = await this.link.plane({ type: "feature", pane, name });
        this.features.set(`${name}${pane}`, plane);
      } catch (e) {
        toast((e as Error).message);
      }
    }
    this.redraw();
  }

  // --- The reference ---

  private async fetchReference(): Promise<void> {
    const said = this.state?.reference ?? null;
    this.flip = null;
    this.flipOf = -1;
    this.reference = said ? await this.link.plane({ type: "reference" }).catch(() => null) : null;
    $<HTMLButtonElement>("forget").disabled = !said;
    $("reference-name").textContent = said ? `${said.name}, ${said.size[0]} × ${said.size[1]}` : "Keep the picture as it is now, or load one, and compare with it.";
    if (!said) this.setCompare("off");
    else if (this.compare === "off") this.setCompare("slider");
    this.redraw();
    this.measure();
  }

  private setCompare(how: typeof this.compare): void {
    this.compare = how;
    document.querySelectorAll<HTMLInputElement>('input[name="compare"]').forEach((i) => (i.checked = i.value === how));
    $("split-row").hidden = how !== "slider" || !this.reference;
    if (how === "flip") void this.fetchFlip();
    this.measure();
    this.redraw();
  }

  private async fetchFlip(): Promise<void> {
    const picture = this.pictures[0]!;
    if (this.flipBusy || !this.reference || this.flipOf === picture.version) return;
    this.flipBusy = true;
    const version = picture.version;
    try {
      this.flip = await this.link.plane({ type: "flip", pane: 0 });
      this.flipOf = version;
    } catch (e) {
      $("compare-result").textContent = (e as Error).message;
    }
    this.flipBusy = false;
    this.measure();
    this.redraw();
  }

  /** How far apart the picture and the reference are. */
  private measure(): void {
    const line = $("compare-result");
    const [p, r] = [this.pictures[0]!, this.reference];
    if (!r) return void (line.textContent = "");
    if (r.width !== p.width || r.height !== p.height) return void (line.textContent = `The pictures have different sizes: ${p.width} × ${p.height}, and ${r.width} × ${r.height}.`);
    let [sum, n] = [0, 0];
    for (let y = 0; y < p.height; y += 2) {
      for (let x = 0; x < p.width; x += 2) {
        const [a, b] = [p.pixel(x, y), planePixel(r, x, y)];
        if (!a || !b) continue;
        for (let c = 0; c < 3; c++) sum += (a[c]! - b[c]!) ** 2 / (b[c]! ** 2 + 0.01);
        n += 3;
      }
    }
    const flip = this.compare === "flip" && this.flip ? `, mean FLIP ${digits(planeMean(this.flip), 3)}` : "";
    line.textContent = n > 0 ? `relMSE ${digits(sum / n, 3)}${flip}` : "";
  }

  // --- Hands ---

  private grab(): void {
    this.grabbed = JSON.stringify(this.options);
  }

  private remember(): void {
    const now = this.grabbed || JSON.stringify(this.options);
    this.grabbed = "";
    if (this.undos[this.undos.length - 1] !== now) this.undos.push(now);
    if (this.undos.length > 200) this.undos.shift();
  }

  private undo(): void {
    const last = this.undos.pop();
    if (!last) return toast("There is nothing to undo");
    this.options = JSON.parse(last) as Options[];
    this.adoptTyped();
    this.send();
    this.fill();
  }

  /** Takes the camera from the options, or from the scene. */
  private adoptTyped(): void {
    const typed = this.options[0]?.["look-at"]?.split(",").map(Number);
    if (typed?.length === 9) {
      [this.camera.eye, this.camera.target, this.camera.up] = [typed.slice(0, 3), typed.slice(3, 6), typed.slice(6)] as [Camera["eye"], Camera["eye"], Camera["eye"]];
    } else this.stale = true;
  }

  private move(how: () => void): void {
    const camera = this.state?.panes[0]?.camera;
    if (!camera) return;
    if (this.grabbed) this.remember();
    how();
    this.setAll("look-at", this.camera.typed);
  }

  /** Sets an option of both sides: cameras are one. */
  private setAll(name: string, value: string): void {
    for (const options of this.options) {
      if (value === "") delete options[name];
      else options[name] = value;
    }
    this.send();
  }

  private send(): void {
    this.sentAt = performance.now();
    if (this.sending) return;
    this.sending = true;
    requestAnimationFrame(() => {
      this.sending = false;
      this.sentAt = performance.now();
      this.options.forEach((options, pane) => this.link.say({ type: "set", pane, options }));
    });
  }

  private pixelOf(): [number, number] {
    const at = this.explored;
    const origin = this.state?.panes[at?.pane ?? 0]?.origin ?? [0, 0];
    return [(at?.x ?? 0) + origin[0], (at?.y ?? 0) + origin[1]];
  }

  private async focus(pane: number, x: number, y: number): Promise<void> {
    const origin = this.state?.panes[pane]?.origin ?? [0, 0];
    const found = await this.link.ask<Probed | null>({ type: "probe", pane, pixel: [x + origin[0], y + origin[1]] }).catch(() => null);
    if (!found) return toast("There is nothing to focus on");
    this.grab();
    this.remember();
    const camera = this.state?.panes[pane]?.camera;
    if (camera) this.camera.target = this.camera.eye.map((v, i) => v + this.camera.forward[i]! * found.depth) as Camera["eye"];
    for (const options of this.options) {
      options["focal-distance"] = String(Number(found.focal_distance.toPrecision(7)));
      // Through a pinhole everything is sharp.
      if (camera && camera.lens_radius === 0) options["lens-radius"] = String(Number((found.focal_distance * 0.01).toPrecision(4)));
    }
    this.viewport.mark = { pane, x, y };
    this.send();
    toast(`Focus at ${digits(found.focal_distance)}`);
  }

  private async explore(pane: number, x: number, y: number): Promise<void> {
    this.explored = { pane, x, y };
    const pixel = this.pixelOf();
    this.explorer.wait(...pixel);
    $("space-box").hidden = false;
    $("stage").classList.add("explored");
    if (matchMedia("(min-width: 56rem)").matches) $("panel").scrollTo({ top: 0 });
    try {
      const data = await this.link.ask<Explored>({ type: "explore", pane, pixel });
      this.explorer.fill(data);
      const state = this.state?.panes[pane];
      if (state && this.scanOf !== data.generation) {
        const scan = await this.link.scan(pane);
        this.scanOf = data.generation;
        this.space.setScan(scan, state.camera, this.camera.up);
      }
      this.space.setPaths([...data.brightest, ...data.usual], 0, true);
      this.keepAddress();
    } catch (e) {
      this.explorer.refuse((e as Error).message);
    }
  }

  private closeExplorer(): void {
    this.explorer.close();
    this.explored = null;
    this.viewport.mark = null;
    $("space-box").hidden = true;
    $("stage").classList.remove("explored");
    this.keepAddress();
    $("overlay").focus({ preventScroll: true });
    this.viewport.refresh();
  }

  // --- Controls ---

  private applyLook(look: Record<string, string>): void {
    const number = (key: string, otherwise: number): number => (look[key] !== undefined && Number.isFinite(Number(look[key])) ? Number(look[key]) : otherwise);
    this.exposure = number("ev", 0);
    this.kelvin = number("white", 6500);
    this.tint = number("tint", 0);
    this.curve = CURVES.includes(look["curve"] as Curve) ? (look["curve"] as Curve) : "agx";
    this.falseColor = look["stops"] === "1";
    const what = look["show"] ?? "light";
    this.what = ["light", "error", "samples", ...FEATURES].includes(what) ? what : "light";
    this.fillLook();
  }

  private fillLook(): void {
    $<HTMLInputElement>("exposure").value = String(this.exposure);
    $<HTMLInputElement>("kelvin").value = String(this.kelvin);
    $<HTMLInputElement>("tint").value = String(this.tint);
    $<HTMLSelectElement>("curve").value = this.curve;
    $<HTMLSelectElement>("what").value = this.what;
    $<HTMLInputElement>("false-color").checked = this.falseColor;
    $("exposure-value").textContent = `${this.exposure > 0 ? "+" : ""}${digits(this.exposure, 3)} EV`;
    $("kelvin-value").textContent = `${this.kelvin} K`;
    $("tint-value").textContent = digits(this.tint, 2);
  }

  private lookChanged(): void {
    this.fillLook();
    this.redraw();
    this.histogram();
    this.keepAddress();
  }

  /** Fills all fields that follow what the server says. */
  private fill(): void {
    const state = this.state;
    const pane = state?.panes[0];
    if (!state || !pane) return;
    const camera = pane.camera;
    const set = (id: string, value: number, words: string): void => {
      const input = $<HTMLInputElement>(id);
      if (document.activeElement !== input || !this.dragging) input.value = String(value);
      $(`${id}-value`).textContent = words;
    };
    const thin = camera.projection === "perspective" || camera.projection === "orthographic";
    const options = this.options[0] ?? {};
    const said = (name: string, otherwise: number): number => (options[name] ? Number(options[name]) : otherwise);
    const fov = said("fov", camera.fov ?? 40);
    $("fov-row").hidden = camera.fov === null;
    set("fov", fov, `${digits(fov, 3)}°`);
    const lens = said("lens-radius", camera.lens_radius);
    set("lens", Math.sqrt(lens / this.mostLens), lens === 0 ? "pinhole" : digits(lens, 3));
    const focal = said("focal-distance", camera.focal_distance);
    set("focal", Math.log(focal / this.leastFocus) / Math.log(4000), lens === 0 ? "everywhere" : digits(focal, 4));
    for (const id of ["lens", "focal"]) $<HTMLInputElement>(id).disabled = !thin;
    const open = camera.shutter[1] - camera.shutter[0];
    $("shutter-row").hidden = !camera.moving && open === 0;
    set("shutter", open / this.shutterLength, `${Math.round((100 * open) / this.shutterLength)} %`);
    const [pause, goal] = [$("pause"), state.goal];
    pause.setAttribute("aria-pressed", String(state.paused));
    pause.textContent = state.paused ? "Resume" : "Pause";
    const [spp, error] = [$<HTMLInputElement>("goal-spp"), $<HTMLInputElement>("goal-error")];
    if (document.activeElement !== spp) spp.value = goal.spp === null ? "" : String(goal.spp);
    if (document.activeElement !== error) error.value = goal.error === null ? "" : digits(goal.error * 100, 3);
    $<HTMLInputElement>("adaptive").checked = state.adaptive;
    $<HTMLInputElement>("compare-on").checked = state.panes.length > 1;
    $("pane-choice").hidden = state.panes.length < 2;
    $("command").textContent = state.panes[this.side]?.command ?? pane.command;
    $("facts").textContent = `${pane.size[0]} × ${pane.size[1]} pixels, ${pane.triangles.toLocaleString("en")} triangles, ${pane.lights.toLocaleString("en")} lights; drawn by ${this.viewport.display.kind === "webgl2" ? "WebGL 2" : "canvas"}`;
    $<HTMLAnchorElement>("save-exr").href = `./picture.exr?token=${encodeURIComponent(query.get("token") ?? "")}&pane=0`;
    const shown = state.panes[this.side] ?? pane;
    const box = $("options");
    if (!box.contains(document.activeElement)) box.replaceChildren(...optionFields(this.options[this.side] ?? {}, shown, (name, value) => this.setOption(name, value)));
  }

  private dragging = false;

  private get mostLens(): number {
    const camera = this.state?.panes[0]?.camera;
    return ((camera?.size ?? 1) / (camera?.scale ?? 1)) * 0.02;
  }

  private get leastFocus(): number {
    const camera = this.state?.panes[0]?.camera;
    return ((camera?.size ?? 1) / (camera?.scale ?? 1)) * 0.001;
  }

  private setOption(name: string, value: string): void {
    this.grab();
    this.remember();
    const options = this.options[this.side]!;
    if (value === "") delete options[name];
    else options[name] = value;
    // A picture of another size cannot be compared side by side.
    if (name === "size") for (const other of this.options) other[name] = value;
    (document.activeElement as HTMLElement | null)?.blur?.();
    this.send();
    queueMicrotask(() => {
      this.fill();
      $(`option-${name}`).focus();
    });
  }

  private keepAddress(): void {
    const look: Record<string, string> = {};
    if (this.exposure !== 0) look["ev"] = String(this.exposure);
    if (this.kelvin !== 6500) look["white"] = String(this.kelvin);
    if (this.tint !== 0) look["tint"] = String(this.tint);
    if (this.curve !== "agx") look["curve"] = this.curve;
    if (this.falseColor) look["stops"] = "1";
    if (this.what !== "light") look["show"] = this.what;
    history.replaceState(null, "", `${location.pathname}${location.search}${address.write({ panes: this.options, look })}`);
  }

  private wire(): void {
    const on = <E extends Event = Event>(id: string, type: string, what: (e: E) => void): void => $(id).addEventListener(type, what as EventListener);
    const value = (id: string): number => Number($<HTMLInputElement>(id).value);
    on("exposure", "input", () => { this.exposure = value("exposure"); this.lookChanged(); });
    on("kelvin", "input", () => { this.kelvin = value("kelvin"); this.lookChanged(); });
    on("tint", "input", () => { this.tint = value("tint"); this.lookChanged(); });
    on("curve", "change", () => { this.curve = $<HTMLSelectElement>("curve").value as Curve; this.lookChanged(); });
    on("false-color", "change", () => { this.falseColor = $<HTMLInputElement>("false-color").checked; this.lookChanged(); });
    on("what", "change", () => {
      this.what = $<HTMLSelectElement>("what").value;
      if (FEATURES.includes(this.what)) void this.fetchFeature();
      this.lookChanged();
    });
    on("reset-look", "click", () => { this.applyLook({}); this.lookChanged(); });
    on("auto-exposure", "click", () => this.autoExposure());

    for (const id of ["fov", "lens", "focal", "shutter"]) {
      on(id, "pointerdown", () => { this.dragging = true; this.grab(); });
      on(id, "keydown", () => this.grab());
      on(id, "change", () => (this.dragging = false));
      on(id, "input", () => {
        if (this.grabbed) this.remember();
        this.lensOption(id, value(id));
        this.fill();
      });
    }
    on("camera-reset", "click", () => {
      this.grab();
      this.remember();
      for (const options of this.options) for (const name of OF_THE_CAMERA) delete options[name];
      this.stale = true;
      this.send();
    });
    on("copy-pbrt", "click", () => void this.link.ask<string>({ type: "pbrt", pane: 0 }).then((text) => copy(text, "Camera")).catch((e: Error) => toast(e.message)));
    on("options-reset", "click", () => {
      this.grab();
      this.remember();
      const own = this.options[this.side]!;
      this.options[this.side] = Object.fromEntries(Object.entries(own).filter(([name]) => (OF_THE_CAMERA as readonly string[]).includes(name) || name === "size"));
      this.send();
      this.fill();
    });
    on("compare-on", "change", () => {
      const two = $<HTMLInputElement>("compare-on").checked;
      if (two) this.options[1] = { ...this.options[0]! };
      else this.options.length = 1;
      this.side = 0;
      document.querySelectorAll<HTMLInputElement>('input[name="pane"]').forEach((i) => (i.checked = i.value === (two ? "1" : "0")));
      if (two) this.side = 1;
      this.sentAt = performance.now();
      this.link.say({ type: "compare", options: two ? this.options[1] : null });
    });
    document.querySelectorAll<HTMLInputElement>('input[name="pane"]').forEach((input) => input.addEventListener("change", () => { this.side = Number(input.value); this.fill(); }));
    document.querySelectorAll<HTMLInputElement>('input[name="tool"]').forEach((input) => input.addEventListener("change", () => this.setTool(input.value as Tool)));
    document.querySelectorAll<HTMLInputElement>('input[name="compare"]').forEach((input) =>
      input.addEventListener("change", () => {
        if (input.value !== "off" && !this.reference) {
          toast("Keep or load a picture first");
          return this.setCompare("off");
        }
        this.setCompare(input.value as typeof this.compare);
      }),
    );
    on("split", "input", () => this.redraw());
    on("keep", "click", () => void this.link.ask({ type: "keep", pane: 0 }).then(() => toast("Kept")).catch((e: Error) => toast(e.message)));
    on("forget", "click", () => void this.link.ask({ type: "keep", pane: null }).catch((e: Error) => toast(e.message)));
    on("load", "change", () => void this.load());
    on("pause", "click", () => this.link.say({ type: "pause", on: !this.state?.paused }));
    on("undo", "click", () => this.undo());
    for (const id of ["goal-spp", "goal-error"]) on(id, "change", () => this.sendGoal());
    on("adaptive", "change", () => this.link.say({ type: "adaptive", on: $<HTMLInputElement>("adaptive").checked }));
    on("save-png", "click", () => this.savePng());
    on("copy-link", "click", () => { this.keepAddress(); void copy(location.href, "Link"); });
    on("copy-command", "click", () => void copy($("command").textContent ?? "", "Command"));
    on("zoom-in", "click", () => this.viewport.zoomBy(1.5));
    on("zoom-out", "click", () => this.viewport.zoomBy(1 / 1.5));
    on("zoom-fit", "click", () => this.viewport.fit());
    on("zoom-one", "click", () => this.viewport.one());
    on("help-open", "click", () => this.help());
    document.addEventListener("keydown", (e) => this.key(e));
    // Pictures that are dropped are loaded.
    document.addEventListener("dragover", (e) => e.preventDefault());
    document.addEventListener("drop", (e) => {
      e.preventDefault();
      const file = e.dataTransfer?.files[0];
      if (file) void this.loadFile(file);
    });
    setInterval(() => {
      if (this.compare === "flip") void this.fetchFlip();
      if (this.compare !== "off") this.measure();
    }, 3000);
  }

  private lensOption(id: string, v: number): void {
    const n = (x: number): string => String(Number(x.toPrecision(6)));
    if (id === "fov") this.setAll("fov", n(v));
    if (id === "lens") this.setAll("lens-radius", n(v * v * this.mostLens));
    if (id === "focal") this.setAll("focal-distance", n(this.leastFocus * 4000 ** v));
    if (id === "shutter") {
      const open = this.state?.panes[0]?.camera.shutter[0] ?? 0;
      this.setAll("shutter-interval", `${n(open)},${n(open + v * this.shutterLength)}`);
    }
  }

  private sendGoal(): void {
    const positive = (id: string): number | null => {
      const v = Number($<HTMLInputElement>(id).value);
      return v > 0 ? v : null;
    };
    const spp = positive("goal-spp");
    const error = positive("goal-error");
    this.link.say({ type: "goal", spp: spp === null ? null : Math.min(2 ** 24, Math.round(spp)), error: error === null ? null : error / 100 });
  }

  private setTool(tool: Tool): void {
    this.viewport.tool = tool;
    $("overlay").dataset["tool"] = tool;
    document.querySelectorAll<HTMLInputElement>('input[name="tool"]').forEach((i) => (i.checked = i.value === tool));
  }

  /** The log-average luminance becomes middle grey (Reinhard et al. 2002). */
  private autoExposure(): void {
    const p = this.pictures[0]!;
    const lit: number[] = [];
    for (let y = 0; y < p.height; y += 2) {
      for (let x = 0; x < p.width; x += 2) {
        const v = p.pixel(x, y);
        const l = v ? luminance([v[0], v[1], v[2]]) : 0;
        if (l > 1e-6) lit.push(l);
      }
    }
    lit.sort((a, b) => a - b);
    const kept = lit.slice(0, Math.ceil(lit.length * 0.99));
    if (kept.length === 0) return;
    const mean = kept.reduce((sum, l) => sum + Math.log2(l), 0) / kept.length;
    this.exposure = Math.round(Math.min(8, Math.max(-8, Math.log2(0.18) - mean)) * 20) / 20;
    this.lookChanged();
  }

  private async load(): Promise<void> {
    const input = $<HTMLInputElement>("load");
    const file = input.files?.[0];
    input.value = "";
    if (file) await this.loadFile(file);
  }

  private async loadFile(file: File): Promise<void> {
    if (file.size > 200 * 2 ** 20) return toast("The file is larger than 200 MiB");
    try {
      await this.link.file(file.name, await file.arrayBuffer());
      toast(`${file.name} loaded`);
    } catch (e) {
      toast((e as Error).message);
    }
  }

  private savePng(): void {
    const p = this.pictures[0]!;
    const canvas = el("canvas");
    [canvas.width, canvas.height] = [p.width, p.height];
    const copyOf = Object.assign(new Picture(), { generation: p.generation, width: p.width, height: p.height, tile: p.tile, texels: p.texels, samples: p.samples, coarse: p.coarse, version: p.version });
    const rect = { x: 0, y: 0, width: p.width, height: p.height };
    makeDisplay(canvas, false).draw([{ picture: copyOf, what: "light", plane: null, range: "colors", reference: null, rect, origin: [0, 0], zoom: 1, split: null, look: this.look }], p.width, p.height);
    canvas.toBlob((blob) => blob && save(blob, "steradian.png"));
  }

  private static readonly KEYS: [string, string][] = [
    ["M  X  F", "Move the camera, explore a pixel, focus on a point"],
    ["← ↑ ↓ →", "Turn the camera; with Shift, shift it. Exploring or focusing: move the mark, by ten with Shift"],
    ["+  −", "Nearer, farther; zoom while exploring"],
    ["Enter", "Explore the marked pixel, or focus on it"],
    ["0  1", "Fit the picture in; one to one"],
    ["[  ]", "Darker, brighter by a quarter stop"],
    ["Space", "Pause, go on"],
    ["Ctrl Z", "Undo"],
    ["Esc", "Close the explorer"],
    ["?", "These keys"],
  ];

  private help(): void {
    $("keys").replaceChildren(...Page.KEYS.map(([keys, words]) => el("tr", {}, el("th", { scope: "row" }, ...keys.split("  ").flatMap((k) => [el("kbd", {}, k), " "])), el("td", {}, words))));
    $<HTMLDialogElement>("help").showModal();
  }

  private key(e: KeyboardEvent): void {
    const target = e.target as HTMLElement;
    if ((e.ctrlKey || e.metaKey) && e.key.toLowerCase() === "z" && !target.matches("input[type=text], input[type=number], textarea")) {
      e.preventDefault();
      return this.undo();
    }
    if (e.ctrlKey || e.metaKey || e.altKey || target.matches("input, select, textarea, dialog *")) return;
    const stop = (v: number): void => {
      this.exposure = Math.min(8, Math.max(-8, this.exposure + v));
      this.lookChanged();
    };
    const keys: Record<string, () => void> = {
      m: () => this.setTool("orbit"),
      x: () => this.setTool("inspect"),
      f: () => this.setTool("focus"),
      0: () => this.viewport.fit(),
      1: () => this.viewport.one(),
      "[": () => stop(-0.25),
      "]": () => stop(0.25),
      "?": () => this.help(),
      Escape: () => this.explorer.open && this.closeExplorer(),
    };
    const act = e.key === " " && !target.matches("button, a, summary, label") ? () => this.link.say({ type: "pause", on: !this.state?.paused }) : keys[e.key];
    if (!act) return;
    e.preventDefault();
    act();
  }

  /** For tests: where a pixel is on the page, and what is known of it. */
  get inside() {
    return {
      at: (pane: number, x: number, y: number) => this.viewport.at(pane, x, y),
      pixel: (pane: number, x: number, y: number) => this.pictures[pane]?.pixel(x, y) ?? null,
      size: (pane: number) => [this.pictures[pane]?.width, this.pictures[pane]?.height],
      generation: (pane: number) => this.pictures[pane]?.generation,
      whole: (pane: number) => this.pictures[pane]?.whole,
      options: () => this.options,
      drop: () => this.link.drop(),
    };
  }
}

declare global {
  interface Window {
    steradian: Page["inside"];
  }
}

const page = new Page();
window.steradian = page.inside;
