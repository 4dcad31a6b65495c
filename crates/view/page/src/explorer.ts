/** The panel that explains a pixel: its value and how sure it is, how it converged, its paths and where each one's light is from. */

import { $, copy, digits, el, svg } from "./dom.ts";
import type { Explored, Num, PathEvent, PathTold } from "./protocol.ts";
import { encode, toneMap } from "./tone.ts";

const num = (v: Num | undefined): number => Number(v ?? NaN);
const three = (v: Num[], n = 3): string => v.slice(0, 3).map((c) => digits(num(c), n)).join("  ");

function swatch(rgb: Num[], gain: number): string {
  const c = toneMap("agx", rgb.slice(0, 3).map((v) => num(v) * gain) as [number, number, number]);
  return `rgb(${c.map((v) => Math.round(255 * encode(v))).join(" ")})`;
}

/** Sets a colour that a policy against inline styles lets through. */
function tint<T extends HTMLElement>(node: T, color: string): T {
  node.style.setProperty("background-color", color);
  return node;
}

export interface ExplorerHands {
  /** Show these paths; the chosen one in full. */
  show(paths: PathTold[], chosen: number): void;
  path(sample: number): Promise<PathTold>;
  close(): void;
}

/** Mean and confidence interval over the number of samples. */
export function convergence(curve: Explored["curve"]): SVGElement {
  const [W, H, L, B] = [320, 130, 42, 20];
  const last = curve[curve.length - 1]!;
  const most = Math.max(2, last[0]);
  const later = curve.filter(([n]) => n >= Math.min(4, most));
  const ends = later.flatMap(([, mean, half]) => [mean - (half ?? 0), mean + (half ?? 0), mean]);
  let [low, high] = [Math.min(...ends), Math.max(...ends)];
  // The first samples may be far off; the end is what matters.
  const half = Math.max(last[2] ?? 0, 1e-6 + Math.abs(last[1]) * 1e-3);
  [low, high] = [Math.max(low, last[1] - 12 * half), Math.min(high, last[1] + 12 * half)];
  if (!(high > low)) [low, high] = [low - 1, low + 1];
  const x = (n: number): number => L + ((W - L - 8) * Math.log(n)) / Math.log(most);
  const y = (v: number): number => H - B - ((H - B - 8) * (Math.min(high, Math.max(low, v)) - low)) / (high - low);
  const line = (f: (c: Explored["curve"][number]) => number): string => curve.map((c) => `${x(c[0]).toFixed(1)},${y(f(c)).toFixed(1)}`).join(" ");
  const band = curve.filter((c) => c[2] !== null);
  const upper = band.map((c) => `${x(c[0]).toFixed(1)},${y(c[1] + c[2]!).toFixed(1)}`);
  const lower = band.map((c) => `${x(c[0]).toFixed(1)},${y(c[1] - c[2]!).toFixed(1)}`).reverse();
  const marks: Node[] = [];
  for (let n = 1; n <= most; n *= n < most / 20 ? 10 : 4) {
    marks.push(svg("text", { x: x(n), y: H - 6, "text-anchor": "middle" }, String(n)));
    marks.push(svg("line", { x1: x(n), x2: x(n), y1: 8, y2: H - B, stroke: "var(--line)" }));
  }
  for (const v of [low, last[1], high]) marks.push(svg("text", { x: L - 4, y: y(v) + 3, "text-anchor": "end" }, digits(v, 3)));
  return svg(
    "svg",
    { viewBox: `0 0 ${W} ${H}`, role: "img", "aria-label": `Mean luminance over the number of samples: ${digits(last[1])} plus or minus ${digits(last[2] ?? 0)} after ${last[0]}` },
    ...marks,
    svg("polygon", { points: [...upper, ...lower].join(" "), fill: "var(--accent)", "fill-opacity": 0.22 }),
    svg("line", { x1: L, x2: W - 8, y1: y(last[1]), y2: y(last[1]), stroke: "var(--soft)", "stroke-dasharray": "3 3" }),
    svg("polyline", { points: line((c) => c[1]), fill: "none", stroke: "var(--accent)", "stroke-width": 1.8 }),
  );
}

export class Explorer {
  private data: Explored | null = null;
  private paths: PathTold[] = [];
  private chosen = 0;

  constructor(private readonly hands: ExplorerHands) {
    $("explorer-close").addEventListener("click", () => hands.close());
  }

  get open(): boolean {
    return !$("explorer").hidden;
  }

  wait(x: number, y: number): void {
    $("explorer").hidden = false;
    $("explorer-title").textContent = `Pixel ${x}, ${y}`;
    if (!this.data) $("explorer-body").replaceChildren(el("p", { class: "hint" }, "Tracing its samples again …"));
  }

  refuse(why: string): void {
    $("explorer-body").replaceChildren(el("p", { class: "hint" }, why));
  }

  close(): void {
    $("explorer").hidden = true;
    this.data = null;
  }

  fill(data: Explored): void {
    this.data = data;
    this.paths = [...data.brightest, ...data.usual];
    this.chosen = Math.min(this.chosen, this.paths.length - 1);
    if (this.chosen < 0) this.chosen = 0;
    this.render();
    this.hands.show(this.paths, this.chosen);
  }

  choose(index: number): void {
    this.chosen = index;
    this.render();
    this.hands.show(this.paths, index);
    const button = $("explorer-body").querySelector<HTMLElement>(`[data-path="${index}"]`);
    button?.focus({ preventScroll: true });
  }

  private async fetch(sample: number): Promise<void> {
    const known = this.paths.findIndex((p) => p.sample === sample);
    if (known >= 0) return this.choose(known);
    this.paths.push(await this.hands.path(sample));
    this.choose(this.paths.length - 1);
  }

  private render(): void {
    const d = this.data;
    if (!d) return;
    const half = d.half_width;
    const relative = half !== null && d.luminance > 0 ? ` (± ${digits((100 * half) / d.luminance, 2)} %)` : "";
    const body = $("explorer-body");
    const path = this.paths[this.chosen];
    const sample = el("input", { type: "number", min: "0", max: "16777215", value: String(path?.sample ?? 0), id: "one-sample" });
    const go = (): void => void this.fetch(Math.max(0, Math.floor(Number(sample.value)))).catch((e: Error) => this.refuse(e.message));
    sample.addEventListener("keydown", (e) => e.key === "Enter" && go());
    const parts = [
      el(
        "div",
        { class: "value" },
        tint(el("div", { class: "swatch", "aria-hidden": "true" }), swatch(d.rgb, 1)),
        el("b", {}, three(d.rgb, 4)),
        el("span", {}, `luminance ${digits(d.luminance, 4)}${half === null ? "" : ` ± ${digits(half, 2)}`}${relative}, 95 %`),
      ),
      el(
        "p",
        { class: "hint" },
        `${d.samples} samples, traced again in ${Math.round(d.took_ms)} ms. `,
        d.same_as_picture === true ? "Their mean is the picture's, bit for bit. " : d.same_as_picture === false ? "The picture has gone on meanwhile. " : "",
        d.splats ? "This algorithm also brings light here from paths of other pixels; these are the pixel's own." : "",
      ),
      el("figure", {}, el("figcaption", {}, "Mean and its 95 % interval, over samples"), convergence(d.curve)),
      el(
        "p",
        { class: "hint" },
        d.luminance > 0
          ? `The brightest ${d.bright_samples} of ${d.samples} samples bring${d.bright_samples === 1 ? "s" : ""} ${digits(100 * d.bright_share, 3)} % of the light; ${digits((100 * d.black) / d.samples, 3)} % are black.`
          : "All samples are black.",
      ),
      el("h3", {}, "Brightest paths"),
      this.list(d.brightest, 0, d),
      el("h3", {}, "Others, as they come"),
      this.list(d.usual, d.brightest.length, d),
      this.paths.length > d.brightest.length + d.usual.length ? this.list(this.paths.slice(d.brightest.length + d.usual.length), d.brightest.length + d.usual.length, d) : null,
      el("div", { class: "one" }, el("label", { for: "one-sample" }, "Sample number"), sample, el("button", { type: "button", click: go }, "Trace")),
      path ? el("h3", {}, `Path of sample ${path.sample}`) : null,
      path ? this.story(path) : null,
    ];
    body.replaceChildren(...parts.filter((p): p is HTMLElement => p !== null));
  }

  private list(paths: PathTold[], first: number, d: Explored): HTMLElement {
    const most = Math.max(...d.brightest.map((p) => num(p.luminance)), 1e-9);
    const total = d.luminance * d.samples;
    return el(
      "ol",
      { class: "paths" },
      ...paths.map((p, k) => {
        const index = first + k;
        const y = num(p.luminance);
        const share = total > 0 ? (100 * y) / total : 0;
        const bar = el("i", {});
        bar.style.setProperty("width", `${Math.max(2, (100 * y) / most)}%`);
        const bounces = p.events.filter((e) => e?.event === "vertex").length;
        return el(
          "li",
          {},
          el(
            "button",
            {
              type: "button",
              "data-path": String(index),
              "aria-pressed": String(index === this.chosen),
              click: () => this.choose(index),
            },
            tint(el("span", { class: "dot" }), swatch(p.rgb, 1)),
            el("span", {}, `#${p.sample}`),
            bar,
            el("span", {}, `${digits(y, 3)} · ${share >= 9.95 ? Math.round(share) : share.toFixed(1)} %`),
            el("span", { class: "unseen" }, ` of the pixel's light, ${bounces} vertices`),
          ),
        );
      }),
    );
  }

  private story(path: PathTold): HTMLElement {
    let vertex = 0;
    const items: HTMLElement[] = [
      el("li", { class: "eye" }, "Camera", el("small", {}, `film ${digits(path.film[0], 6)}, ${digits(path.film[1], 6)}`, path.wavelengths ? ` · ${path.wavelengths.map((w) => Math.round(num(w))).join(", ")} nm` : " · red, green, blue")),
    ];
    for (const event of path.events) {
      if (!event) continue;
      if (event.event === "vertex") vertex += 1;
      items.push(this.event(event, vertex));
    }
    const state = path.exact === true ? el("span", { class: "ok" }, "equal, bit for bit ✓") : path.exact === false ? el("span", { class: "no" }, "differs by rounding") : null;
    const sum = el(
      "p",
      { class: "sum", id: "path-sum" },
      path.told
        ? `${path.contributions} contribution${path.contributions === 1 ? "" : "s"}, in sum ${three(path.sum, 5)}; the sample is ${three(path.rgb, 5)}; `
        : `The sample is ${three(path.rgb, 5)}. This algorithm does not tell its contributions one by one.`,
      path.told ? "radiances are " : "",
      state,
    );
    sum.dataset["sum"] = JSON.stringify(path.sum);
    sum.dataset["rgb"] = JSON.stringify(path.rgb);
    sum.dataset["exact"] = String(path.exact);
    return el(
      "div",
      {},
      el("ol", { class: "story" }, ...items),
      sum,
      path.cut ? el("p", { class: "hint" }, "The path goes on; only its first events are shown.") : null,
      el("pre", { class: "command", tabindex: "0", "aria-label": "The command that traces this path" }, path.command),
      el("div", { class: "buttons" }, el("button", { type: "button", id: "copy-trace", click: () => void copy(path.command, "Command") }, "Copy command")),
    );
  }

  private event(event: PathEvent, vertex: number): HTMLElement {
    if (event.event === "vertex") {
      const material = event.material ? `material ${event.material} · ` : "";
      return el("li", {}, `${vertex}  ${event.lobe}`, el("small", {}, `${material}throughput ${event.throughput.map((t) => digits(num(t))).join(" ")}`));
    }
    if (event.event === "bounce") {
      const how = event.specular ? (event.transmission ? "refracted" : "mirrored") : event.transmission ? "scattered through" : "scattered";
      const lives = num(event.survival) < 1 ? ` · survives with ${digits(num(event.survival))}` : "";
      return el("li", { class: event.specular ? "specular" : "" }, `goes on, ${how}`, el("small", {}, `pdf ${digits(num(event.pdf))} · weight ${event.weight.map((w) => digits(num(w))).join(" ")}${lives}`));
    }
    const light = event.light === null ? "a light" : `light ${event.light}`;
    const how = event.sampled ? (event.occluded ? `shadow ray to ${light}: blocked` : `shadow ray to ${light}`) : `runs into ${light}`;
    return el(
      "li",
      { class: event.occluded ? "blocked" : "light" },
      how,
      el(
        "small",
        {},
        `pdf ${digits(num(event.pdf))} · the other way ${digits(num(event.other_pdf))} · MIS weight ${digits(num(event.weight))}`,
        el("br"),
        event.occluded ? "would add " : "adds ",
        three(event.rgb),
      ),
    );
  }
}
