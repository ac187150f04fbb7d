// Looks at the four reports of run.sh in Chromium. Fails at the first claim that does not hold.
import assert from "node:assert/strict";
import { readFileSync, statSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";
import puppeteer from "puppeteer-core";

const folder = process.argv[2];
const axe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
const address = (name) => `file://${join(folder, name + ".html")}`;
const outcomes = { good: "full", ambiguous: "none", failed: "none", survey: "partial" };

const browser = await puppeteer.launch({
  executablePath: process.env.CHROMIUM,
  args: ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
});

/** A page that must neither complain nor ask for anything but its own file. */
async function opened(name, { colours = "light", javascript = true } = {}) {
  const page = await browser.newPage();
  await page.setViewport({ width: 1280, height: 900 });
  await page.setJavaScriptEnabled(javascript);
  await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: colours }]);
  const problems = [];
  page.on("console", (m) => { if (["error", "warn"].includes(m.type()) && !/GPU stall|GL Driver/.test(m.text())) problems.push(m.text()); });
  page.on("pageerror", (e) => problems.push(String(e)));
  page.on("request", (r) => { if (!r.url().startsWith("file://")) problems.push(r.url()); });
  await page.goto(address(name), { waitUntil: "load" });
  page.problems = problems;
  return page;
}

const hasView = (page) => page.$("#view_data").then(Boolean);
const isDrawn = (page) => page.waitForSelector("canvas[data-drawn]", { timeout: 30000 });
/** Draws, and counts the pixels of the view that are not background. */
const countPoints = (page) => page.evaluate(async () => {
  const canvas = document.querySelector("canvas");
  await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
  const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d");
  copy.drawImage(canvas, 0, 0);
  const { data } = copy.getImageData(0, 0, canvas.width, canvas.height);
  let count = 0;
  for (let i = 0; i < data.length; i += 4)
    count += data[i] !== data[0] || data[i + 1] !== data[1] || data[i + 2] !== data[2];
  return count;
});
const pictureOf = (page) => page.evaluate(() => document.querySelector("canvas").toDataURL());

async function checkAccessibility(page, name) {
  await page.evaluate(axe);
  const { violations } = await page.evaluate(() => globalThis.axe.run());
  const found = violations.map((v) => `${v.id}: ${v.help}; ${v.nodes[0].html.slice(0, 200)} ${v.nodes[0].failureSummary}`);
  assert.deepEqual(found, [], `${name}: axe-core`);
}

async function checkView(page, name) {
  await isDrawn(page);
  const all = await countPoints(page);
  assert.ok(all > 2000, `${name}: only ${all} pixels of points`);
  await page.click('input[name="scan"]');
  const fewer = await countPoints(page);
  assert.ok(fewer > 0 && fewer < all, `${name}: a hidden scan is still there`);
  await page.click('input[name="scan"]');
  assert.equal(await countPoints(page), all, `${name}: a scan does not come back`);
  for (const [what, act] of [
    ["colour by height", () => page.click('input[value="height above ground"]')],
    ["a key turns", async () => { await page.focus("canvas"); await page.keyboard.press("ArrowLeft"); }],
    ["a key zooms", () => page.keyboard.press("+")],
    ["a button turns", () => page.click(".tools button")],
    ["the mouse turns", async () => {
      const box = await (await page.$("canvas")).boundingBox();
      await page.mouse.move(box.x + 300, box.y + 200);
      await page.mouse.down();
      await page.mouse.move(box.x + 420, box.y + 230, { steps: 4 });
      await page.mouse.up();
    }],
  ]) {
    const before = await pictureOf(page);
    await act();
    await countPoints(page);
    await new Promise((done) => setTimeout(done, 100));
    assert.ok((await pictureOf(page)) !== before, `${name}: ${what}`);
  }
  return all;
}

/** The pictures of transforms, of which one is shown. */
async function checkChoice(page, name) {
  const visible = () => page.$$eval(".choice > div", (all) => all.map((d) => getComputedStyle(d).display !== "none"));
  const count = (await visible()).length;
  assert.ok(count > 1, `${name}: no alternatives`);
  assert.deepEqual(await visible(), Array.from({ length: count }, (_, i) => i === 0));
  await page.click("#shown_1");
  assert.deepEqual(await visible(), Array.from({ length: count }, (_, i) => i === 1));
  await page.click("#shown_0");
}

/** Colours of the dots beside the names of scans. */
const dotsOf = (page) =>
  page.$$eval(".swatch", (all) => all.map((dot) => getComputedStyle(dot).backgroundColor));

async function checkReport(name) {
  assert.ok(statSync(join(folder, name + ".html")).size < 15e6, `${name}: too large`);
  const page = await opened(name);
  assert.ok(await page.$(`section.trust.${outcomes[name]}`), `${name}: trust`);
  const shown = await page.evaluate(() => new Promise((done) => new PerformanceObserver((list) => {
    const first = list.getEntriesByName("first-contentful-paint");
    if (first.length) done(first[0].startTime);
  }).observe({ type: "paint", buffered: true })));
  assert.ok(shown < 2000, `${name}: first picture after ${shown} ms`);
  let points = 0, view = 0;
  const dots = [];
  if (await hasView(page)) {
    points = await checkView(page, name);
    dots.push(...await dotsOf(page));
    view = await page.evaluate(() => performance.getEntriesByName("view_3d")[0].startTime);
  }
  if (name === "ambiguous") {
    await checkChoice(page, name);
    await countPoints(page);
    const before = await pictureOf(page);
    await page.click("#shown_1");
    await countPoints(page);
    assert.ok((await pictureOf(page)) !== before, "the view does not follow the chosen transform");
    await page.click("#shown_0");
  }
  await checkAccessibility(page, name);
  assert.deepEqual(page.problems, [], name);
  await page.evaluate(() => scrollTo(0, 0));
  await page.screenshot({ path: join(folder, `${name}_light.png`) });
  await page.screenshot({ path: join(folder, `${name}_whole.png`), fullPage: true });
  await page.emulateMediaType("print");
  await page.setViewport({ width: 794, height: 1123 });
  await page.screenshot({ path: join(folder, `${name}_print.png`), fullPage: true });
  await page.close();

  const dark = await opened(name, { colours: "dark" });
  if (await hasView(dark)) await isDrawn(dark);
  const darkDots = await dotsOf(dark);
  assert.equal(darkDots.length, dots.length, `${name}, dark: dots`);
  darkDots.forEach((colour, i) => assert.notEqual(colour, dots[i], `${name}, dark: a dot keeps its light colour`));
  await checkAccessibility(dark, `${name}, dark`);
  await dark.screenshot({ path: join(folder, `${name}_dark.png`), fullPage: true });
  assert.deepEqual(dark.problems, [], `${name}, dark`);
  await dark.close();

  const narrow = await opened(name);
  await narrow.setViewport({ width: 390, height: 800 });
  const width = await narrow.evaluate(() => document.documentElement.scrollWidth);
  assert.ok(width <= 390, `${name}: ${width} px wide on a telephone`);
  await narrow.screenshot({ path: join(folder, `${name}_narrow.png`) });
  await narrow.close();

  const plain = await opened(name, { javascript: false });
  assert.ok((await plain.$$("figure svg")).length > 0, `${name}: no picture without JavaScript`);
  if (name === "ambiguous") await checkChoice(plain, `${name} without JavaScript`);
  await plain.screenshot({ path: join(folder, `${name}_plain.png`), fullPage: true });
  await plain.close();
  console.log(`${name}: ${Math.round(statSync(join(folder, name + ".html")).size / 1000)} kB, first picture after ` +
    `${Math.round(shown)} ms, 3-D view after ${Math.round(view)} ms with ${points} pixels of points`);
}

try {
  for (const name of Object.keys(outcomes)) await checkReport(name);
} finally {
  await browser.close();
}
