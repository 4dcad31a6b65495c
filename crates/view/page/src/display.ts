/** Draws pictures: exposure, white balance, curve and false colours happen here, at once, by WebGL 2 or without it. */

import { Picture } from "./picture.ts";
import type { Plane, Vec3 } from "./protocol.ts";
import { ACES_IN, ACES_OUT, AGX_IN, AGX_OUT, CURVES, MAGMA, encode, half, luminance, magma, toneMap, type Curve } from "./tone.ts";

/** What is shown of a pane. */
export type What = "light" | "error" | "samples" | "feature" | "difference" | "flip";
const WHATS: readonly What[] = ["light", "error", "samples", "feature", "difference", "flip"];

/** How light becomes colours. */
export interface Look {
  curve: Curve;
  /** Stops. */
  exposure: number;
  /** Factors of white balance. */
  gains: Vec3;
  falseColor: boolean;
  /** Columns: red, green and blue of the film, in sRGB. */
  toSrgb: [Vec3, Vec3, Vec3];
}

/** One picture in its place on the canvas, in device pixels from the top left. */
export interface Place {
  picture: Picture;
  what: What;
  /** A feature, or a map of differences. */
  plane: Plane | null;
  /** What shows in the plane: colours, light, numbers of this range. */
  range: [number, number] | "colors" | "light";
  /** The picture to compare with. */
  reference: Plane | null;
  rect: { x: number; y: number; width: number; height: number };
  /** Where the top left corner of the picture is, and how large its pixels are. */
  origin: [number, number];
  zoom: number;
  /** Right of this, the reference is shown. */
  split: number | null;
  look: Look;
}

export interface Display {
  readonly kind: "webgl2" | "2d";
  draw(places: readonly Place[], width: number, height: number): void;
}

const mat3 = (m: readonly number[]): string =>
  `mat3(${[0, 3, 6, 1, 4, 7, 2, 5, 8].map((i) => m[i]!.toFixed(9)).join(",")})`;

const FRAGMENT = `#version 300 es
precision highp float;
precision highp int;
uniform sampler2D u_full, u_coarse, u_tiles, u_plane, u_reference;
uniform ivec2 u_size;
uniform vec3 u_coarse_scale;
uniform float u_exposure, u_most, u_tile;
uniform vec3 u_gains;
uniform mat3 u_srgb;
uniform int u_what, u_curve, u_plane_kind;
uniform bool u_false, u_has_coarse, u_of_reference;
uniform vec2 u_range;
out vec4 color;

const vec3 Y = vec3(0.2126, 0.7152, 0.0722);
const vec3 MAGMA[9] = vec3[9](${MAGMA.map((c) => `vec3(${c.map((v) => (v / 255).toFixed(5)).join(",")})`).join(",")});

vec3 magma(float t) {
  if (!(t == t)) return vec3(0.0, 1.0, 0.0);
  float x = clamp(t, 0.0, 1.0) * 8.0;
  int i = int(min(x, 7.0));
  return mix(MAGMA[i], MAGMA[i + 1], x - float(i));
}
vec3 encode(vec3 v) {
  return mix(12.92 * v, 1.055 * pow(max(v, 0.0031308), vec3(1.0 / 2.4)) - 0.055, step(0.0031308, v));
}
vec3 hable(vec3 x) {
  return (x * (0.15 * x + 0.05) + 0.004) / (x * (0.15 * x + 0.5) + 0.06) - 0.02 / 0.3;
}
vec3 curve(vec3 v) {
  v = clamp(v, 0.0, 1e9);
  if (u_curve == 0) {
    vec3 x = clamp((log2(max(${mat3(AGX_IN)} * v, 1e-10)) + 12.47393) / 16.5, 0.0, 1.0);
    vec3 x2 = x * x, x4 = x2 * x2;
    vec3 c = 15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.00232;
    return pow(max(${mat3(AGX_OUT)} * c, 0.0), vec3(2.2));
  }
  if (u_curve == 1) {
    vec3 c = ${mat3(ACES_IN)} * min(v, 1e4);
    c = (c * (c + 0.0245786) - 0.000090537) / (c * (0.983729 * c + 0.432951) + 0.238081);
    return ${mat3(ACES_OUT)} * c;
  }
  if (u_curve == 2) return hable(2.0 * min(v, 1e6)) / hable(vec3(11.2));
  if (u_curve == 3) { float y = dot(v, Y); return v * ((1.0 + y / 16.0) / (1.0 + y)); }
  return v;
}
vec3 light(vec3 film) {
  vec3 v = (u_srgb * film) * u_gains * u_exposure;
  if (u_false) return magma((log2(max(dot(v, Y), 1e-9) / 0.18) + 7.0) / 14.0);
  return encode(clamp(curve(v), 0.0, 1.0));
}
float samples(ivec2 p) { return texelFetch(u_tiles, p / int(u_tile), 0).r; }
vec4 film(ivec2 p) {
  if (samples(p) > 0.0) return texelFetch(u_full, p, 0);
  if (!u_has_coarse) return vec4(0.0, 0.0, 0.0, 6e4);
  return texture(u_coarse, (vec2(p) + 0.5) / (u_coarse_scale.x * u_coarse_scale.yz));
}
vec3 shown(ivec2 p, bool reference) {
  p = clamp(p, ivec2(0), u_size - 1);
  if (reference) return light(texelFetch(u_reference, p, 0).rgb);
  if (u_what == 0) return light(film(p).rgb);
  if (u_what == 1) {
    float e = film(p).a;
    return e < 5e4 ? magma((log2(max(e, 1e-6)) / 3.3219281 + 3.0) / 3.0) : vec3(0.35);
  }
  if (u_what == 2) return magma(samples(p) / max(u_most, 1.0));
  if (u_what == 3) {
    vec4 v = texelFetch(u_plane, p, 0);
    if (u_plane_kind == 0) return clamp(v.rgb, 0.0, 1.0) * step(0.001, v.a) + vec3(0.06) * step(v.a, 0.001);
    if (u_plane_kind == 1) return encode(clamp(v.rgb, 0.0, 1.0));
    return v.a < 0.001 ? vec3(0.06) : magma(1.0 - (v.r - u_range.x) / max(u_range.y - u_range.x, 1e-9));
  }
  if (u_what == 4) {
    float a = dot(film(p).rgb, Y), b = dot(texelFetch(u_reference, p, 0).rgb, Y);
    return magma(2.0 * abs(a - b) / (abs(a) + abs(b) + 1e-4));
  }
  return magma(texelFetch(u_plane, p, 0).r);
}
void main() { color = vec4(shown(ivec2(gl_FragCoord.xy), u_of_reference), 1.0); }`;

/** Lays a picture that has its colours onto the canvas. */
const LAY = `#version 300 es
precision highp float;
uniform sampler2D u_picture;
uniform vec2 u_size, u_origin;
uniform float u_zoom, u_height, u_lines;
out vec4 color;
void main() {
  vec2 q = (vec2(gl_FragCoord.x, u_height - gl_FragCoord.y) - u_origin) / u_zoom;
  if (q.x < 0.0 || q.y < 0.0 || q.x >= u_size.x || q.y >= u_size.y) { color = vec4(0.0); return; }
  vec3 c = texture(u_picture, q / u_size).rgb;
  if (u_lines > 0.0) {
    vec2 edge = min(fract(q), 1.0 - fract(q)) * u_zoom;
    c = mix(c, vec3(0.5), 0.35 * (1.0 - step(0.6, min(edge.x, edge.y))));
  }
  color = vec4(c, 1.0);
}`;

const VERTEX = `#version 300 es
void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }`;

/** A texture that remembers what is in it. */
interface Held {
  texture: WebGLTexture;
  key: unknown;
}

/** A picture with its colours, and what it was made from. */
interface Colored {
  texture: WebGLTexture;
  frame: WebGLFramebuffer;
  key: string;
}

interface PaneTextures {
  full: WebGLTexture;
  tiles: WebGLTexture;
  coarse: WebGLTexture;
  generation: number;
}

class Program {
  private readonly program: WebGLProgram;
  private readonly at = new Map<string, WebGLUniformLocation | null>();

  constructor(
    private readonly gl: WebGL2RenderingContext,
    fragment: string,
  ) {
    const shader = (kind: number, source: string): WebGLShader => {
      const s = gl.createShader(kind)!;
      gl.shaderSource(s, source);
      gl.compileShader(s);
      if (!gl.getShaderParameter(s, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(s) ?? "shader");
      return s;
    };
    this.program = gl.createProgram();
    gl.attachShader(this.program, shader(gl.VERTEX_SHADER, VERTEX));
    gl.attachShader(this.program, shader(gl.FRAGMENT_SHADER, fragment));
    gl.linkProgram(this.program);
    if (!gl.getProgramParameter(this.program, gl.LINK_STATUS)) throw new Error("the shader does not link");
  }

  use(): void {
    this.gl.useProgram(this.program);
  }

  u(name: string): WebGLUniformLocation | null {
    if (!this.at.has(name)) this.at.set(name, this.gl.getUniformLocation(this.program, name));
    return this.at.get(name) ?? null;
  }
}

class Gl implements Display {
  readonly kind = "webgl2";
  private readonly coloring: Program;
  private readonly laying: Program;
  private readonly panes = new Map<Picture, PaneTextures>();
  private readonly colored = new Map<string, Colored>();
  private readonly planes: Held[] = [];
  private readonly empty: WebGLTexture;

  constructor(private readonly gl: WebGL2RenderingContext) {
    this.coloring = new Program(gl, FRAGMENT);
    this.laying = new Program(gl, LAY);
    gl.bindVertexArray(gl.createVertexArray());
    this.empty = this.texture(false);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA16F, 1, 1, 0, gl.RGBA, gl.HALF_FLOAT, new Uint16Array(4));
  }

  private texture(smooth: boolean): WebGLTexture {
    const gl = this.gl;
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    const filter = smooth ? gl.LINEAR : gl.NEAREST;
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, filter);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, filter);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    return texture;
  }

  /** Brings what is new of a picture to the graphics card. */
  private upload(p: Picture): PaneTextures {
    const gl = this.gl;
    let own = this.panes.get(p);
    if (!own) {
      own = { full: this.texture(false), tiles: this.texture(false), coarse: this.texture(true), generation: -1 };
      this.panes.set(p, own);
      p.fresh = true;
      p.coarseFresh = p.coarse !== null;
    }
    const columns = p.columns;
    if (p.fresh) {
      gl.bindTexture(gl.TEXTURE_2D, own.full);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA16F, p.width, p.height, 0, gl.RGBA, gl.HALF_FLOAT, p.texels);
    } else if (p.dirty.size > 0) {
      gl.bindTexture(gl.TEXTURE_2D, own.full);
      gl.pixelStorei(gl.UNPACK_ROW_LENGTH, p.width);
      // Whole rows of tiles where most are new, or else tile by tile.
      const rows = new Map<number, number[]>();
      for (const i of p.dirty) {
        const row = Math.floor(i / columns);
        const list = rows.get(row);
        if (list) list.push(i % columns);
        else rows.set(row, [i % columns]);
      }
      for (const [row, list] of rows) {
        const [first, last] = list.length > 4 ? [Math.min(...list), Math.max(...list)] : [0, -1];
        const spans = last >= first ? [[first, last] as const] : list.map((c) => [c, c] as const);
        for (const [from, to] of spans) {
          const [x, y] = [from * p.tile, row * p.tile];
          const [w, h] = [Math.min(p.width, (to + 1) * p.tile) - x, Math.min(p.tile, p.height - y)];
          gl.texSubImage2D(gl.TEXTURE_2D, 0, x, y, w, h, gl.RGBA, gl.HALF_FLOAT, p.texels, (y * p.width + x) * 4);
        }
      }
      gl.pixelStorei(gl.UNPACK_ROW_LENGTH, 0);
    }
    if (p.fresh || p.dirty.size > 0 || own.generation !== p.generation) {
      gl.bindTexture(gl.TEXTURE_2D, own.tiles);
      const rows = p.samples.length / Math.max(1, columns);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.R32F, columns, rows, 0, gl.RED, gl.FLOAT, p.samples);
      own.generation = p.generation;
    }
    if (p.coarseFresh && p.coarse) {
      gl.bindTexture(gl.TEXTURE_2D, own.coarse);
      const { columns: w, rows: h, texels } = p.coarse;
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA16F, w, h, 0, gl.RGBA, gl.HALF_FLOAT, texels);
    }
    p.dirty.clear();
    p.fresh = false;
    p.coarseFresh = false;
    return own;
  }

  private plane(plane: Plane | null): WebGLTexture {
    if (!plane) return this.empty;
    const held = this.planes.find((h) => h.key === plane);
    if (held) return held.texture;
    const gl = this.gl;
    const slot = this.planes.length < 6 ? { texture: this.texture(false), key: plane as unknown } : this.planes.shift()!;
    slot.key = plane;
    this.planes.push(slot);
    gl.bindTexture(gl.TEXTURE_2D, slot.texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA16F, plane.width, plane.height, 0, gl.RGBA, gl.HALF_FLOAT, plane.texels);
    return slot.texture;
  }

  /** Gives a picture its colours, at its own size; only if anything has changed. */
  private color(slot: string, place: Place, reference: boolean, own: PaneTextures): Colored {
    const gl = this.gl;
    const p = place.picture;
    const key = JSON.stringify([p.version, p.generation, p.width, p.height, place.what, place.plane?.id, place.look, place.reference?.id, place.range]);
    let slotOf = this.colored.get(slot);
    if (slotOf?.key === key) return slotOf;
    slotOf ??= { texture: this.texture(true), frame: gl.createFramebuffer(), key: "" };
    this.colored.set(slot, slotOf);
    gl.bindTexture(gl.TEXTURE_2D, slotOf.texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, p.width, p.height, 0, gl.RGBA, gl.UNSIGNED_BYTE, null);
    slotOf.key = key;
    gl.bindFramebuffer(gl.FRAMEBUFFER, slotOf.frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, slotOf.texture, 0);
    gl.disable(gl.SCISSOR_TEST);
    gl.viewport(0, 0, p.width, p.height);
    const { coloring } = this;
    const fits = place.reference?.width === p.width && place.reference.height === p.height;
    const needsPlane = place.what === "feature" || place.what === "flip";
    const what = (place.what === "difference" && !fits) || (needsPlane && !place.plane) ? "light" : place.what;
    const plane = this.plane(place.plane);
    const other = this.plane(fits ? place.reference : null);
    coloring.use();
    [own.full, own.coarse, own.tiles, plane, other].forEach((texture, i) => {
      gl.activeTexture(gl.TEXTURE0 + i);
      gl.bindTexture(gl.TEXTURE_2D, texture);
    });
    ["u_full", "u_coarse", "u_tiles", "u_plane", "u_reference"].forEach((name, i) => gl.uniform1i(coloring.u(name), i));
    gl.activeTexture(gl.TEXTURE0);
    gl.uniform1i(coloring.u("u_of_reference"), reference ? 1 : 0);
    gl.uniform2i(coloring.u("u_size"), p.width, p.height);
    gl.uniform1i(coloring.u("u_has_coarse"), p.coarse ? 1 : 0);
    if (p.coarse) gl.uniform3f(coloring.u("u_coarse_scale"), p.coarse.stride, p.coarse.columns, p.coarse.rows);
    gl.uniform1f(coloring.u("u_exposure"), 2 ** place.look.exposure);
    gl.uniform1f(coloring.u("u_most"), what === "samples" ? p.samples.reduce((a, b) => Math.max(a, b), 1) : 1);
    gl.uniform1f(coloring.u("u_tile"), p.tile);
    gl.uniform3fv(coloring.u("u_gains"), place.look.gains);
    gl.uniformMatrix3fv(coloring.u("u_srgb"), false, place.look.toSrgb.flat());
    gl.uniform1i(coloring.u("u_what"), WHATS.indexOf(what));
    gl.uniform1i(coloring.u("u_curve"), CURVES.indexOf(place.look.curve));
    gl.uniform1i(coloring.u("u_false"), place.look.falseColor ? 1 : 0);
    gl.uniform1i(coloring.u("u_plane_kind"), place.range === "colors" ? 0 : place.range === "light" ? 1 : 2);
    const range = typeof place.range === "string" ? [0, 1] : place.range;
    gl.uniform2f(coloring.u("u_range"), range[0]!, range[1]!);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.bindTexture(gl.TEXTURE_2D, slotOf.texture);
    gl.generateMipmap(gl.TEXTURE_2D);
    return slotOf;
  }

  draw(places: readonly Place[], width: number, height: number): void {
    const gl = this.gl;
    const made = places.map((place, i) => {
      const p = place.picture;
      if (p.width === 0) return [];
      const own = this.upload(p);
      const fits = place.reference?.width === p.width && place.reference.height === p.height;
      const split = fits && place.split !== null;
      return [this.color(`${i}`, place, false, own), ...(split ? [this.color(`${i}r`, place, true, own)] : [])];
    });
    gl.disable(gl.SCISSOR_TEST);
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.enable(gl.SCISSOR_TEST);
    const { laying } = this;
    laying.use();
    gl.uniform1i(laying.u("u_picture"), 0);
    gl.uniform1f(laying.u("u_height"), height);
    places.forEach((place, i) => {
      made[i]!.forEach((colored, k) => {
        const { x, y, width: w, height: h } = place.rect;
        const from = k === 0 ? x : Math.min(x + w, Math.max(x, place.split!));
        gl.scissor(from, height - y - h, x + w - from, h);
        gl.bindTexture(gl.TEXTURE_2D, colored.texture);
        const sharp = place.zoom >= 4;
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, sharp ? gl.NEAREST : gl.LINEAR);
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, sharp ? gl.NEAREST : gl.LINEAR_MIPMAP_LINEAR);
        gl.uniform2f(laying.u("u_size"), place.picture.width, place.picture.height);
        gl.uniform2f(laying.u("u_origin"), place.origin[0], place.origin[1]);
        gl.uniform1f(laying.u("u_zoom"), place.zoom);
        gl.uniform1f(laying.u("u_lines"), place.zoom >= 24 ? 1 : 0);
        gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
      });
    });
  }
}

/** Without WebGL: the same pictures, by the processor, pixel for pixel. */
class Flat implements Display {
  readonly kind = "2d";
  private readonly held = new Map<string, { key: string; canvas: OffscreenCanvas | HTMLCanvasElement }>();

  constructor(private readonly context: CanvasRenderingContext2D) {}

  private paint(place: Place, reference: boolean): HTMLCanvasElement {
    const canvas = document.createElement("canvas");
    const p = place.picture;
    [canvas.width, canvas.height] = [p.width, p.height];
    const context = canvas.getContext("2d")!;
    const data = context.createImageData(p.width, p.height);
    const { look, plane } = place;
    const most = p.samples.reduce((a, b) => Math.max(a, b), 1);
    const scale = 2 ** look.exposure;
    const texel = (t: Uint16Array, at: number): Vec3 => [half(t[at]!), half(t[at + 1]!), half(t[at + 2]!)];
    const light = (film: Vec3): Vec3 => {
      const [r, g, b] = look.toSrgb;
      const v = [0, 1, 2].map((i) => (r[i]! * film[0] + g[i]! * film[1] + b[i]! * film[2]) * look.gains[i]! * scale) as Vec3;
      if (look.falseColor) return magma((Math.log2(Math.max(luminance(v), 1e-9) / 0.18) + 7) / 14);
      return toneMap(look.curve, v).map((c) => 255 * encode(c)) as Vec3;
    };
    for (let y = 0, at = 0; y < p.height; y++) {
      for (let x = 0; x < p.width; x++, at += 4) {
        const pixel = p.pixel(x, y);
        if (!pixel) continue;
        let c: Vec3;
        const other = place.reference ? texel(place.reference.texels, at) : null;
        if (reference && other) c = light(other);
        else if (place.what === "error") c = pixel[3] < 5e4 ? magma(Math.log10(Math.max(pixel[3], 1e-6)) / 3 + 1) : [90, 90, 90];
        else if (place.what === "samples") c = magma(pixel[4] / most);
        else if (place.what === "flip" && plane) c = magma(half(plane.texels[at]!));
        else if (place.what === "feature" && plane) {
          const v = texel(plane.texels, at);
          if (place.range === "colors") c = v.map((k) => 255 * Math.min(1, Math.max(0, k))) as Vec3;
          else if (place.range === "light") c = v.map((k) => 255 * encode(Math.min(1, Math.max(0, k)))) as Vec3;
          else c = magma(1 - (v[0] - place.range[0]) / Math.max(1e-9, place.range[1] - place.range[0]));
        } else if (place.what === "difference" && other) {
          const [a, b] = [luminance([pixel[0], pixel[1], pixel[2]]), luminance(other)];
          c = magma((2 * Math.abs(a - b)) / (Math.abs(a) + Math.abs(b) + 1e-4));
        } else c = light([pixel[0], pixel[1], pixel[2]]);
        data.data.set([c[0] + 0.5, c[1] + 0.5, c[2] + 0.5, 255], at);
      }
    }
    context.putImageData(data, 0, 0);
    return canvas;
  }

  draw(places: readonly Place[], width: number, height: number): void {
    const c = this.context;
    c.clearRect(0, 0, width, height);
    places.forEach((place, i) => {
      const p = place.picture;
      if (p.width === 0) return;
      for (const reference of place.split !== null && place.reference ? [false, true] : [false]) {
        const slot = `${i}${reference}`;
        const key = JSON.stringify([p.version, place.what, place.plane?.id, place.look, place.reference?.id, place.range]);
        if (this.held.get(slot)?.key !== key) this.held.set(slot, { key, canvas: this.paint(place, reference) });
        const { x, y, width: w, height: h } = place.rect;
        c.save();
        c.beginPath();
        if (reference) c.rect(place.split!, y, x + w - place.split!, h);
        else c.rect(x, y, w, h);
        c.clip();
        c.imageSmoothingEnabled = place.zoom < 4;
        c.drawImage(this.held.get(slot)!.canvas, place.origin[0], place.origin[1], p.width * place.zoom, p.height * place.zoom);
        c.restore();
      }
    });
  }
}

/** The best that this browser can do; `?canvas=2d` asks for less. */
export function makeDisplay(canvas: HTMLCanvasElement, plain: boolean): Display {
  if (!plain) {
    const gl = canvas.getContext("webgl2", { alpha: true, antialias: false, premultipliedAlpha: true, preserveDrawingBuffer: true });
    if (gl) return new Gl(gl);
  }
  return new Flat(canvas.getContext("2d")!);
}
