// The page in a real browser, with the renderer behind it. STERADIAN names the program, CHROMIUM the browser; SHOTS a folder for pictures.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { browse, finish, open, section, serve, test, until, whole } from "./harness.mjs";

const axe = createRequire(import.meta.url).resolve("axe-core/axe.min.js");
const folder = mkdtempSync(join(tmpdir(), "steradian-page-"));
const scene = join(folder, "room.pbrt");
const TEXT = `LookAt 0 1.2 -6  0 1 0  0 1 0
Camera "perspective" "float fov" 40
Film "rgb" "integer xresolution" 144 "integer yresolution" 96
Sampler "zsobol" "integer pixelsamples" 16
Integrator "path" "integer maxdepth" 5
WorldBegin
LightSource "infinite" "rgb L" [ .3 .35 .4 ]
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [ 14 13 11 ]
  Translate -2 4 -1
  Shape "sphere" "float radius" .5
AttributeEnd
Material "diffuse" "rgb reflectance" [ .6 .6 .6 ]
Shape "bilinearmesh" "point3 P" [ -8 0 -8  8 0 -8  -8 0 8  8 0 8 ]
Material "conductor" "float roughness" .1
AttributeBegin
  Translate -.8 .8 0
  Shape "sphere" "float radius" .8
AttributeEnd
Material "dielectric"
AttributeBegin
  Translate 1.1 .6 -.6
  Shape "sphere" "float radius" .6
AttributeEnd
`;
writeFileSync(scene, TEXT);

const shots = process.env.SHOTS;
const shot = (page, name) => (shots ? page.screenshot({ path: join(shots, `${name}.png`), timeout: 90_000 }) : null);
const server = await serve([scene, "--threads", "1"]);
const browser = await browse();
/** The mean code of what is on the canvas. */
const brightness = (page) =>
  page.evaluate(() => {
    const from = document.getElementById("canvas");
    const to = document.createElement("canvas");
    [to.width, to.height] = [64, 64];
    const c = to.getContext("2d");
    c.drawImage(from, 0, 0, 64, 64);
    return c.getImageData(0, 0, 64, 64).data.reduce((sum, v, i) => sum + (i % 4 < 3 ? v : 0), 0) / (64 * 64 * 3);
  });
/** Waits until what is on the canvas satisfies `f`; the mean code. */
async function bright(page, what, f) {
  const start = Date.now();
  for (;;) {
    const value = await brightness(page);
    if (f(value)) return value;
    assert.ok(Date.now() - start < 40_000, `${what}: ${value}`);
    await page.waitForTimeout(60);
  }
}
const generation = (page) => page.evaluate(() => window.steradian.generation(0));
const tool = (page, n) => page.locator(".tools label").nth(n).click();
const clickPixel = async (page, x, y) => {
  const at = await page.evaluate(([x, y]) => window.steradian.at(0, x, y), [x, y]);
  await page.mouse.click(at[0], at[1]);
};
const goal = (page, spp) => section(page, "Run and save").then(() => page.fill("#goal-spp", String(spp))).then(() => page.press("#goal-spp", "Enter"));
const clean = (complaints) => assert.deepEqual(complaints.filter((c) => !/GPU stall|software WebGL|swiftshader/i.test(c)), []);

const { page, complaints, context } = await open(browser, server.url, { colorScheme: "dark" });

await test("the page loads and the first picture comes", async () => {
  await whole(page);
  assert.equal(await page.textContent("#scene"), "room.pbrt");
  assert.deepEqual(await page.evaluate(() => window.steradian.size(0)), [144, 96]);
  const latency = Number(await page.evaluate(() => document.body.dataset.latency));
  console.log(`        first picture ${latency.toFixed(0)} ms after the change`);
  assert.ok(latency > 0);
  await bright(page, "something is to be seen", (v) => v > 15);
  clean(complaints);
});

await test("orbit changes the picture, and undo brings it back", async () => {
  const [before, value] = [await generation(page), await page.evaluate(() => window.steradian.pixel(0, 30, 60))];
  const box = await page.locator("#overlay").boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await page.mouse.down();
  await page.mouse.move(box.x + box.width / 2 + 160, box.y + box.height / 2 - 30, { steps: 6 });
  await page.mouse.up();
  await until(page, (g) => window.steradian.generation(0) > g && window.steradian.whole(0), before, 60_000);
  const options = await page.evaluate(() => window.steradian.options()[0]);
  assert.match(options["look-at"], /^-?[\d.e-]+(,-?[\d.e-]+){8}$/);
  assert.notDeepEqual(await page.evaluate(() => window.steradian.pixel(0, 30, 60)), value);
  await page.click("#undo");
  await until(page, () => window.steradian.options()[0]["look-at"] === undefined && window.steradian.whole(0), null, 60_000);
});

await test("exposure, curves and false colours happen in the page", async () => {
  // The test before may have said something last that the server is still to hear.
  let before = -1;
  for (let now = await generation(page); now !== before; now = await generation(page)) {
    before = now;
    await page.waitForTimeout(700);
  }
  const start = await brightness(page);
  await page.fill("#exposure", "3");
  await until(page, () => document.getElementById("exposure-value").textContent === "+3 EV");
  let last = await bright(page, "brighter", (v) => v > start + 20);
  for (const curve of ["aces", "filmic", "reinhard", "clip", "agx"]) {
    await page.selectOption("#curve", curve);
    last = await bright(page, curve, (v) => Math.abs(v - last) > 0.05);
  }
  await page.check("#false-color");
  assert.ok(await page.isVisible("#scale"));
  await page.click("#reset-look");
  await bright(page, "as before", (v) => v < last - 20);
  assert.equal(await page.textContent("#exposure-value"), "0 EV");
  assert.equal(await generation(page), before, "the server had nothing to do");
});

await test("a click focuses", async () => {
  await tool(page, 2);
  await clickPixel(page, 52, 50);
  await until(page, () => Number(window.steradian.options()[0]["focal-distance"]) > 0, null, 30_000);
  const options = await page.evaluate(() => window.steradian.options()[0]);
  const distance = Number(options["focal-distance"]);
  assert.ok(distance > 4 && distance < 6, `the ball is five away, not ${distance}`);
  assert.ok(Number(options["lens-radius"]) > 0, "through a pinhole everything would be sharp");
  await section(page, "Camera");
  await page.click("#camera-reset");
  await until(page, () => window.steradian.options()[0]["focal-distance"] === undefined && window.steradian.whole(0), null, 60_000);
});

await test("the explorer's path is the server's, and the command line's", async () => {
  await goal(page, 64);
  await until(page, () => Number(document.body.dataset.spp) >= 63.99, null, 120_000);
  await page.click("#reset-look").catch(() => {});
  await tool(page, 1);
  await clickPixel(page, 52, 60);
  await page.waitForSelector("#path-sum", { timeout: 60_000 });
  const text = await page.textContent("#explorer-body");
  assert.match(text, /the picture's, bit for bit/);
  const sum = await page.evaluate(() => ({ ...document.getElementById("path-sum").dataset }));
  assert.equal(sum.exact, "true");
  const [added, rgb] = [JSON.parse(sum.sum), JSON.parse(sum.rgb)];
  added.forEach((v, i) => assert.ok(Math.abs(v - rgb[i]) <= 1e-5 * Math.max(1e-3, Math.abs(rgb[i])), `${v} is not ${rgb[i]}`));
  const command = await page.textContent("#explorer-body pre.command");
  const words = command.match(/'(?:[^']*)'|\S+/g).map((w) => w.replace(/^'|'$/g, ""));
  assert.deepEqual(words.slice(0, 2), ["steradian", "trace"]);
  const told = JSON.parse(execFileSync(process.env.STERADIAN ?? "steradian", [...words.slice(1), "--json"], { encoding: "utf8" }));
  assert.deepEqual(told.rgb ?? told.color ?? told.colour, rgb, "the same numbers, to the last digit");
  assert.ok((await page.locator(".paths button").count()) > 12);
  await page.locator('.paths button[data-path="3"]').click();
  assert.equal(await page.getAttribute('.paths button[data-path="3"]', "aria-pressed"), "true");
  await page.fill("#one-sample", "5");
  await page.press("#one-sample", "Enter");
  await until(page, () => /Path of sample 5/.test(document.getElementById("explorer-body").textContent), null, 30_000);
  await page.waitForTimeout(500);
  await shot(page, "explorer-dark");
  await page.click("#explorer-close");
  await tool(page, 0);
});

await test("what is seen can be shown instead of light", async () => {
  for (const name of ["normal", "albedo", "depth", "material", "error", "samples"]) {
    const before = await brightness(page);
    await page.selectOption("#what", name);
    await bright(page, name, (v) => Math.abs(v - before) > 0.3);
  }
  await page.selectOption("#what", "light");
});

await test("side by side in equal time", async () => {
  await section(page, "Light");
  await page.check("#compare-on");
  await page.waitForSelector("#pane-choice:not([hidden])", { timeout: 60_000 });
  await page.selectOption("#option-integrator", "bdpt");
  await whole(page, 1);
  await until(page, () => window.steradian.options()[1]?.integrator === "bdpt", null, 30_000);
  assert.equal(await page.evaluate(() => window.steradian.options()[0].integrator), undefined);
  await shot(page, "side-by-side");
  await page.uncheck("#compare-on");
  await until(page, () => document.getElementById("pane-choice").hidden, null, 60_000);
});

await test("a picture is kept and compared with, by difference and FLIP", async () => {
  await whole(page);
  await goal(page, 256);
  await section(page, "Compare");
  await page.click("#keep");
  await until(page, () => /kept picture, 144/.test(document.getElementById("reference-name").textContent), null, 30_000);
  assert.ok(await page.isVisible("#split"));
  await page.locator("#compare-how label").nth(3).click();
  await until(page, () => /mean FLIP/.test(document.getElementById("compare-result").textContent), null, 60_000);
  const [error, flip] = (await page.textContent("#compare-result")).match(/\d[\d.e-]*/g).map(Number);
  assert.ok(error < 0.2 && flip < 0.2, `${error} ${flip}`);
  await page.locator("#compare-how label").nth(2).click();
  await page.click("#forget");
  await until(page, () => document.getElementById("forget").disabled, null, 30_000);
});

await test("pictures are saved, and loaded to compare with", async () => {
  await section(page, "Run and save");
  const saved = async (id) => {
    const [download] = await Promise.all([page.waitForEvent("download"), page.click(id)]);
    const path = join(folder, download.suggestedFilename());
    await download.saveAs(path);
    return path;
  };
  assert.deepEqual([...readFileSync(await saved("#save-png")).subarray(1, 4)], [0x50, 0x4e, 0x47]);
  const exr = await saved("#save-exr");
  assert.deepEqual([...readFileSync(exr).subarray(0, 4)], [0x76, 0x2f, 0x31, 0x01]);
  await section(page, "Compare");
  await page.setInputFiles("#load", exr);
  await until(page, () => /steradian.exr, 144/.test(document.getElementById("reference-name").textContent), null, 30_000);
  await until(page, () => /relMSE/.test(document.getElementById("compare-result").textContent), null, 30_000);
  await page.setInputFiles("#load", scene);
  await until(page, () => /room.pbrt/.test(document.getElementById("toast").textContent), null, 30_000);
  await page.click("#forget");
});

await test("pause, go on, stop", async () => {
  await goal(page, 100_000);
  await page.click("#pause");
  await until(page, () => document.getElementById("pause").getAttribute("aria-pressed") === "true", null, 30_000);
  await page.waitForTimeout(700);
  const frozen = await page.evaluate(() => document.body.dataset.spp);
  await page.waitForTimeout(700);
  assert.equal(await page.evaluate(() => document.body.dataset.spp), frozen);
  await page.click("#pause");
  await until(page, (n) => Number(document.body.dataset.spp) > Number(n), frozen, 60_000);
  await goal(page, 64);
  await until(page, () => /done/.test(document.getElementById("numbers").textContent), null, 60_000);
});

await test("two tabs see one render, and a view is handed on by its address", async () => {
  const other = await open(browser, server.url, { colorScheme: "light" });
  await whole(other.page);
  const before = await generation(page);
  await other.page.locator("#overlay").focus();
  await other.page.keyboard.press("ArrowLeft");
  await other.page.keyboard.press("Shift+ArrowUp");
  await until(page, (g) => window.steradian.generation(0) > g, before, 60_000);
  const options = await other.page.evaluate(() => window.steradian.options()[0]);
  await other.page.fill("#exposure", "-1");
  await until(other.page, () => location.hash.includes("ev=-1") && location.hash.includes("look-at"), null, 30_000);
  const link = other.page.url();
  await page.click("#undo").catch(() => {});
  const third = await open(browser, link);
  await until(third.page, (o) => window.steradian?.options()[0]?.["look-at"] === o, options["look-at"], 60_000);
  assert.equal(await third.page.inputValue("#exposure"), "-1");
  clean(other.complaints);
  await other.context.close();
  await third.context.close();
});

await test("a lost connection comes back", async () => {
  const before = await page.evaluate(() => Number(document.body.dataset.frames));
  await page.evaluate(() => window.steradian.drop());
  await until(page, () => document.body.dataset.connection === "lost", null, 10_000).catch(() => {});
  await until(page, (n) => document.body.dataset.connection === "open" && Number(document.body.dataset.frames) > n && window.steradian.whole(0), before, 60_000);
  assert.ok(await page.isHidden("#alert"));
});

await test("a scene that breaks is told with line and caret, and the picture stays", async () => {
  const before = await generation(page);
  writeFileSync(scene, TEXT.replace('Material "conductor"', 'Materiel "conductor"'));
  await until(page, () => /room\.pbrt:15:1[\s\S]*\^\^\^/.test(document.getElementById("alert-text").textContent), null, 30_000);
  assert.equal(await generation(page), before);
  await bright(page, "the picture stays", (v) => v > 15);
  await shot(page, "broken-scene");
  writeFileSync(scene, TEXT.replace(".6 .6 .6", ".9 .2 .1"));
  await until(page, (g) => document.getElementById("alert").hidden && window.steradian.generation(0) > g && window.steradian.whole(0), before, 60_000);
});

await test("nothing but the keyboard", async () => {
  await page.focus(".skip");
  const seen = new Set();
  for (let i = 0; i < 14; i++) {
    await page.keyboard.press("Tab");
    seen.add(await page.evaluate(() => document.activeElement?.id || document.activeElement?.getAttribute("name") || ""));
  }
  assert.ok(["pause", "overlay", "tool"].every((id) => seen.has(id)), [...seen].join(" "));
  await page.locator("#overlay").focus();
  await page.keyboard.press("x");
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("Enter");
  await page.waitForSelector("#path-sum", { timeout: 60_000 });
  await page.keyboard.press("Escape");
  assert.ok(await page.isHidden("#explorer"));
  await page.keyboard.press("?");
  assert.ok(await page.isVisible("#help"));
  await page.keyboard.press("Escape");
  await page.keyboard.press("m");
});

/** What axe finds wrong. */
async function faults(p) {
  await p.addScriptTag({ path: axe }).catch(async () => p.evaluate(readFileSync(axe, "utf8")));
  const found = await p.evaluate(() => window.axe.run(document, { resultTypes: ["violations"] }));
  return found.violations.map((v) => `${v.id}: ${v.help} ${v.nodes.map((n) => n.target.join(" ")).slice(0, 3).join(" | ")}`);
}

for (const [name, options] of [
  ["desktop, light", { colorScheme: "light" }],
  ["desktop, dark", { colorScheme: "dark" }],
  ["phone, light", { colorScheme: "light", viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true, deviceScaleFactor: 2 }],
  ["phone, dark", { colorScheme: "dark", viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true, deviceScaleFactor: 2 }],
]) {
  await test(`accessible: ${name}`, async () => {
    const tab = await open(browser, server.url, { ...options, bypassCSP: true });
    await whole(tab.page);
    for (const title of ["Light", "Compare", "Run and save"]) await section(tab.page, title);
    assert.deepEqual(await faults(tab.page), []);
    const wide = await tab.page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
    assert.ok(wide <= 0, `${wide} pixels too wide`);
    await tool(tab.page, 1);
    await clickPixel(tab.page, 100, 60);
    await tab.page.waitForSelector("#path-sum", { timeout: 60_000 });
    assert.deepEqual(await faults(tab.page), []);
    await tab.page.waitForTimeout(400);
    await shot(tab.page, name.replace(", ", "-"));
    clean(tab.complaints);
    await tab.context.close();
  });
}

await test("without WebGL the picture is the same", async () => {
  const plain = await open(browser, `${server.url}&canvas=2d`);
  await whole(plain.page);
  const gl = await open(browser, server.url);
  await whole(gl.page);
  await section(plain.page, "Run and save");
  assert.match(await plain.page.textContent("#facts"), /drawn by canvas/);
  const a = await bright(gl.page, "WebGL", (v) => v > 15);
  await bright(plain.page, `as bright as ${a}`, (v) => Math.abs(a - v) < 2.5);
  await plain.context.close();
  await gl.context.close();
});

await test("a wrong secret is told", async () => {
  const tab = await open(browser, server.url.replace(/token=.*/, "token=0"));
  await until(tab.page, () => /does not let this page in/.test(document.getElementById("alert-text").textContent), null, 20_000);
  await tab.context.close();
});

await test("Ctrl-C ends the server, tabs or not", async () => {
  const how = await server.stop();
  assert.equal(how?.code, 0, server.said());
  await until(page, () => document.body.dataset.connection !== "open", null, 10_000);
});

await context.close();
await browser.close();
rmSync(folder, { recursive: true, force: true });
finish();
