// What the tests of the page stand on: a server at work, a browser, and a list of what passed.

import { spawn } from "node:child_process";
import { existsSync } from "node:fs";
import { readFile } from "node:fs/promises";
import { chromium } from "playwright-core";

const binary = process.env.STERADIAN ?? "steradian";
const browserPath = process.env.CHROMIUM ?? ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"].find(existsSync);

let passed = 0;
let failed = 0;
const only = process.env.ONLY;

/** Runs one test; the others go on if it fails. */
export async function test(name, body) {
  if (only && !name.includes(only)) return;
  const start = Date.now();
  try {
    await body();
    passed += 1;
    console.log(`ok      ${name} (${Date.now() - start} ms)`);
  } catch (e) {
    failed += 1;
    console.log(`FAILED  ${name} (${Date.now() - start} ms)\n${e.stack ?? e}`);
  }
}

export function finish() {
  console.log(`\n${passed} passed, ${failed} failed`);
  process.exitCode = failed > 0 ? 1 : 0;
}

/** A server of a scene; `url` is where its page is. */
export async function serve(args = []) {
  const child = spawn(binary, ["view", ...args], { stdio: ["ignore", "pipe", "pipe"] });
  let said = "";
  child.stderr.on("data", (d) => (said += d));
  const ended = new Promise((resolve) => child.on("exit", (code, signal) => resolve({ code, signal })));
  const url = await new Promise((resolve, reject) => {
    let text = "";
    child.stdout.on("data", (d) => {
      text += d;
      const found = /http:\S+/.exec(text);
      if (found) resolve(found[0]);
    });
    ended.then(() => reject(new Error(`the server ended: ${said}`)));
  });
  const stop = async () => {
    child.kill("SIGINT");
    const slow = new Promise((resolve) => setTimeout(() => resolve(null), 10_000));
    const how = await Promise.race([ended, slow]);
    if (!how) child.kill("SIGKILL");
    return how;
  };
  return { url, stop, pid: child.pid, said: () => said };
}

export async function browse() {
  if (!browserPath) throw new Error("there is no Chromium; set CHROMIUM to its path");
  return chromium.launch({
    executablePath: browserPath,
    // A real browser, drawing by software where there is no graphics card.
    args: [
      "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist",
      // A page that a test puts in place of the server's comes from nowhere, as the browser sees it.
      ...(process.env.PAGE_FRESH ? ["--disable-features=LocalNetworkAccessChecks"] : []),
    ],
  });
}

/** A tab. Everything that the page complains about is kept in `complaints`. */
export async function open(browser, url, options = {}) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 800 }, reducedMotion: "reduce", ...options });
  const page = await context.newPage();
  page.setDefaultTimeout(60_000);
  page.setDefaultNavigationTimeout(90_000);
  const complaints = [];
  page.on("console", (m) => ["error", "warning"].includes(m.type()) && complaints.push(m.text()));
  page.on("pageerror", (e) => complaints.push(String(e)));
  // While the page is written: files of a fresh build instead of those in the binary.
  if (process.env.PAGE_FRESH) {
    for (const [file, type] of [["page.js", "text/javascript"], ["page.css", "text/css"], ["icon.svg", "image/svg+xml"], ["", "text/html"]]) {
      await page.route(
        (u) => u.pathname === `/${file}`,
        async (route) => {
          const response = await route.fetch();
          const body = await readFile(`${process.env.PAGE_FRESH}/${file || "index.html"}`);
          await route.fulfill({ response, body, contentType: type });
        },
      );
    }
  }
  await page.goto(url);
  return { page, context, complaints };
}

/** Waits until `f`, run in the page, gives something. */
export const until = (page, f, arg, timeout = 40_000) => page.waitForFunction(f, arg, { timeout, polling: 50 });

/** Waits for the whole picture. */
export const whole = (page, pane = 0) => until(page, (p) => window.steradian?.whole(p), pane, 60_000);

/** Opens a section of the panel. */
export async function section(page, title) {
  const details = page.locator("details", { has: page.locator("h2", { hasText: title }) }).first();
  if ((await details.getAttribute("open")) === null) await details.locator("summary").click();
  return details;
}
