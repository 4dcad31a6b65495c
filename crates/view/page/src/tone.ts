/**
 * Light without bounds to what a screen can show: the same curves as crates/image/src/tonemap.rs, here for canvases without WebGL and
 * for the histogram. display.ts has them as shaders.
 */

import type { Vec3 } from "./protocol.ts";

export const CURVES = ["agx", "aces", "filmic", "reinhard", "clip"] as const;
export type Curve = (typeof CURVES)[number];

const mul = (m: readonly number[], v: Vec3): Vec3 => [
  m[0]! * v[0] + m[1]! * v[1] + m[2]! * v[2],
  m[3]! * v[0] + m[4]! * v[1] + m[5]! * v[2],
  m[6]! * v[0] + m[7]! * v[1] + m[8]! * v[2],
];

export const AGX_IN = [
  0.84247906, 0.0784336, 0.07922375, 0.04232824, 0.87846864, 0.07916613, 0.042375654, 0.0784336, 0.87914297,
];
export const AGX_OUT = [
  1.196879, -0.09802088, -0.09902974, -0.05289685, 1.1519031, -0.09896118, -0.052971635, -0.09804345, 1.1510737,
];
export const ACES_IN = [0.59719, 0.35458, 0.04823, 0.076, 0.90834, 0.01566, 0.0284, 0.13383, 0.83777];
export const ACES_OUT = [1.60475, -0.53108, -0.07367, -0.10208, 1.10813, -0.00605, -0.00327, -0.07276, 1.07602];

const hable = (x: number): number => {
  const [a, b, c, d, e, f] = [0.15, 0.5, 0.1, 0.2, 0.02, 0.3] as const;
  return (x * (a * x + c * b) + d * e) / (x * (a * x + b) + d * f) - e / f;
};

const agx = (v: number): number => {
  const x = Math.min(1, Math.max(0, (Math.log2(Math.max(v, 1e-10)) + 12.47393) / 16.5));
  const x2 = x * x;
  const x4 = x2 * x2;
  return 15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.00232;
};

const clamp = (v: number): number => (v > 0 ? Math.min(v, 1) : 0);

export const luminance = (v: Vec3): number => 0.2126 * v[0] + 0.7152 * v[1] + 0.0722 * v[2];

/** Linear light to linear light that a screen can show. */
export function toneMap(curve: Curve, rgb: Vec3): Vec3 {
  const v = rgb.map((c) => (c > 0 ? Math.min(c, 1e9) : 0)) as Vec3;
  switch (curve) {
    case "clip":
      return v.map(clamp) as Vec3;
    case "reinhard": {
      const y = luminance(v);
      return v.map((c) => clamp((c * (1 + y / 16)) / (1 + y))) as Vec3;
    }
    case "filmic":
      return v.map((c) => clamp(hable(2 * c) / hable(11.2))) as Vec3;
    case "aces": {
      const fit = (c: number): number => (c * (c + 0.0245786) - 0.000090537) / (c * (0.983729 * c + 0.432951) + 0.238081);
      return mul(ACES_OUT, mul(ACES_IN, v).map(fit) as Vec3).map(clamp) as Vec3;
    }
    case "agx":
      return mul(AGX_OUT, mul(AGX_IN, v).map(agx) as Vec3).map((c) => clamp(Math.max(c, 0) ** 2.2)) as Vec3;
  }
}

export const encode = (v: number): number => (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055);

/** The colour of a black body, as linear sRGB of luminance one (Kim et al. 2002). */
function planckian(kelvin: number): Vec3 {
  const t = Math.min(25000, Math.max(1667, kelvin));
  const [t1, t2, t3] = [1e3 / t, 1e6 / t ** 2, 1e9 / t ** 3];
  const x =
    t < 4000
      ? -0.2661239 * t3 - 0.234358 * t2 + 0.8776956 * t1 + 0.17991
      : -3.0258469 * t3 + 2.1070379 * t2 + 0.2226347 * t1 + 0.24039;
  const [x2, x3] = [x * x, x * x * x];
  const y =
    t < 2222
      ? -1.1063814 * x3 - 1.3481102 * x2 + 2.18555832 * x - 0.20219683
      : t < 4000
        ? -0.9549476 * x3 - 1.37418593 * x2 + 2.09137015 * x - 0.16748867
        : 3.081758 * x3 - 5.8733867 * x2 + 3.75112997 * x - 0.37001483;
  const [X, Y, Z] = [x / y, 1, (1 - x - y) / y];
  return [
    3.2404542 * X - 1.5371385 * Y - 0.4985314 * Z,
    -0.969266 * X + 1.8760108 * Y + 0.041556 * Z,
    0.0556434 * X - 0.2040259 * Y + 1.0572252 * Z,
  ];
}

/** Factors that make light of this temperature white; tint is from green (-1) to magenta (1). */
export function whiteBalance(kelvin: number, tint: number): Vec3 {
  const [from, to] = [planckian(kelvin), planckian(6504)];
  const gains = from.map((c, i) => to[i]! / Math.max(c, 1e-3)) as Vec3;
  gains[1] *= 2 ** (-0.5 * tint);
  const y = luminance(gains);
  return gains.map((g) => g / y) as Vec3;
}

/** Nine colours of the scale "magma" (van der Walt and Smith 2015, CC0). */
export const MAGMA: readonly Vec3[] = [
  [0, 0, 4],
  [29, 17, 71],
  [81, 18, 124],
  [131, 38, 129],
  [183, 55, 121],
  [231, 82, 99],
  [252, 137, 97],
  [254, 195, 136],
  [252, 253, 191],
];

/** sRGB codes of a value from 0 to 1. */
export function magma(t: number): Vec3 {
  const x = Math.min(1, Math.max(0, t)) * (MAGMA.length - 1);
  const i = Math.min(MAGMA.length - 2, Math.floor(x));
  const [a, b] = [MAGMA[i]!, MAGMA[i + 1]!];
  return a.map((c, k) => c + (b[k]! - c) * (x - i)) as Vec3;
}

const HALF = new Float32Array(65536);
for (let bits = 0; bits < 65536; bits++) {
  const [sign, exponent, fraction] = [bits >> 15, (bits >> 10) & 31, bits & 1023];
  const size = exponent === 0 ? fraction * 2 ** -24 : exponent === 31 ? (fraction ? NaN : Infinity) : (1 + fraction / 1024) * 2 ** (exponent - 15);
  HALF[bits] = sign ? -size : size;
}

/** The value of a half float. */
export const half = (bits: number): number => HALF[bits]!;
