/** The options that the page offers for how light is followed: those of the command line, by their names. */

import { el } from "./dom.ts";
import type { Options, PaneState } from "./protocol.ts";

interface Choice {
  name: string;
  label: string;
  /** Values with their words; the first is what the scene says. */
  values?: [string, string][];
  number?: { min: number; max: number; placeholder: string };
  /** Only for these integrators. */
  only?: string[];
}

const PATHS = ["path", "volpath"];

const CHOICES: Choice[] = [
  {
    name: "integrator",
    label: "Integrator",
    values: [["", "as the scene says"], ["path", "Path tracing"], ["volpath", "Path tracing, media"], ["bdpt", "Bidirectional"], ["lightpath", "Light tracing"], ["simplevolpath", "Random walk, media"], ["whitted", "Whitted 1980"], ["distribution", "Distribution, Cook 1984"], ["ao", "Ambient occlusion"], ["normals", "Normals"], ["albedo", "Albedo"], ["depth", "Depth"], ["uv", "Surface coordinates"]],
  },
  { name: "max-depth", label: "Bounces", number: { min: 0, max: 1000, placeholder: "as the scene says" } },
  {
    name: "sampler",
    label: "Sampler",
    values: [["", "as the scene says"], ["paddedsobol", "Padded Sobol"], ["independent", "Independent"], ["stratified", "Stratified"], ["halton", "Halton"], ["sobol", "Sobol"], ["zsobol", "Z-Sobol"], ["pmj02bn", "PMJ02, blue noise"]],
  },
  { name: "light-sampling", label: "Light sampling", values: [["", "on"], ["off", "off"]], only: PATHS },
  { name: "lobe-sampling", label: "Directions by", values: [["", "lobe"], ["cosine", "cosine"], ["uniform", "uniform"]], only: PATHS },
  { name: "mis", label: "Weights (MIS)", values: [["", "power"], ["balance", "balance"], ["none", "none"]], only: PATHS },
  { name: "roulette", label: "Russian roulette", values: [["", "on"], ["off", "off"]], only: PATHS },
  { name: "split", label: "Split first hit", number: { min: 1, max: 64, placeholder: "1" }, only: PATHS },
  { name: "stratify", label: "Stratify", values: [["", "by the sampler"], ["none", "none"], ["jittered", "jittered"], ["low-discrepancy", "low discrepancy"]] },
  { name: "subpixels", label: "Rays per pixel, k × k", number: { min: 1, max: 16, placeholder: "1" }, only: ["distribution"] },
  { name: "light-rays", label: "Shadow rays, s × s", number: { min: 1, max: 8, placeholder: "1" }, only: ["distribution"] },
  { name: "lobe-rays", label: "Lobe rays, r × r", number: { min: 1, max: 8, placeholder: "1" }, only: ["distribution"] },
  { name: "color", label: "Colour", values: [["", "as the scene says"], ["spectral", "Wavelengths"], ["rgb", "Red, green, blue"]] },
  { name: "filter", label: "Pixel filter", values: [["", "as the scene says"], ["box", "Box"], ["triangle", "Triangle"], ["gaussian", "Gaussian"], ["mitchell", "Mitchell"], ["sinc", "Windowed sinc"]] },
  { name: "seed", label: "Seed", number: { min: 0, max: 2 ** 31, placeholder: "as the scene says" } },
  { name: "clamp", label: "Limit of a sample", number: { min: 0.001, max: 1e6, placeholder: "none" } },
];

/** The names that belong to the camera. */
export const OF_THE_CAMERA = ["look-at", "fov", "lens-radius", "focal-distance", "shutter-interval"] as const;

/** Builds the fields, filled from the options; tells what is changed. */
export function optionFields(options: Options, pane: PaneState, change: (name: string, value: string) => void): HTMLElement[] {
  const integrator = options["integrator"] ?? pane.integrator;
  const size = options["size"] ?? pane.size.join("x");
  const fields = CHOICES.filter((c) => !c.only || c.only.includes(integrator)).map((c) => {
    const value = options[c.name] ?? "";
    if (c.values) {
      const known = c.values.some(([v]) => v === value);
      const list: [string, string][] = known ? c.values : [...c.values, [value, value]];
      const select = el("select", { id: `option-${c.name}`, change: (e) => change(c.name, (e.target as HTMLSelectElement).value) }, ...list.map(([v, words]) => el("option", { value: v, selected: v === value }, words)));
      return el("label", { class: "row" }, el("span", {}, c.label), select);
    }
    const n = c.number!;
    const input = el("input", {
      type: "number", id: `option-${c.name}`, min: String(n.min), max: String(n.max), step: "any", value, placeholder: n.placeholder,
      change: (e) => change(c.name, (e.target as HTMLInputElement).value.trim()),
    });
    return el("label", { class: "row" }, el("span", {}, c.label), input);
  });
  const input = el("input", { type: "text", id: "option-size", value: size, spellcheck: "false", change: (e) => change("size", (e.target as HTMLInputElement).value.trim()) });
  fields.push(el("label", { class: "row" }, el("span", {}, "Width × height"), input));
  return fields;
}
