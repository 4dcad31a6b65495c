/** What is seen, in the address of the page: so that a view can be kept and handed on. */

import type { Options } from "./protocol.ts";

export interface Kept {
  /** Options of the left side, and of the right one if there are two. */
  panes: Options[];
  look: Record<string, string>;
}

const pack = (options: Options): string => Object.entries(options).map(([k, v]) => `${k}=${v}`).join("&");

export function read(hash: string): Kept | null {
  const all = new URLSearchParams(hash.replace(/^#/, ""));
  const panes: Options[] = [];
  for (const name of ["a", "b"]) {
    const text = all.get(name);
    if (text !== null) panes.push(Object.fromEntries(new URLSearchParams(text)));
  }
  const look: Record<string, string> = {};
  for (const [key, value] of all) if (key !== "a" && key !== "b") look[key] = value;
  return panes.length > 0 || Object.keys(look).length > 0 ? { panes, look } : null;
}

export function write({ panes, look }: Kept): string {
  const all = new URLSearchParams();
  panes.forEach((options, i) => Object.keys(options).length > 0 && all.set(i === 0 ? "a" : "b", pack(options)));
  for (const [key, value] of Object.entries(look)) all.set(key, value);
  const text = all.toString();
  return text ? `#${text}` : "";
}
