// Opens every page of the site from its file, wide and narrow, some in the dark, as a reader's browser would:
//     node check.mjs SITE [FOLDER]
// Fails where a page asks for anything outside its folder, logs an error, has a link that leads nowhere, is wider
// than the window, or where axe finds a serious error of accessibility; and where search, formulas or enlarging do
// not work. Says how long the slowest page took to load. Screenshots go to FOLDER.
import axe from "axe-core";
import { existsSync, mkdirSync, readdirSync } from "node:fs";
import path from "node:path";
import { fileURLToPath } from "node:url";
import { fail, find_inaccessible, finish, launch, open, window_of as window_on } from "./reader.mjs";

const [site, shots] = process.argv.slice(2).map((p) => path.resolve(p));
if (!site || !existsSync(path.join(site, "index.html"))) {
    console.error("usage: node check.mjs SITE [FOLDER], and SITE has an index.html");
    process.exit(2);
}
if (shots) mkdirSync(shots, { recursive: true });

const pages = readdirSync(site, { recursive: true })
    .filter((name) => name.endsWith(".html") && !name.startsWith("_static"))
    .sort();

const browser = await launch("--allow-file-access-from-files"); // the search shows a few lines of each page that it finds
const window_of = (scheme, width) => window_on(browser, site, scheme, width);

const ids = new Map(); // of each page, those that links may lead to
const links = []; // [from, page, id]
// Dark colours are the theme's and the code's, the same on all pages: a few show them all.
const dark_pages = ["index.html", "performance.html", "recursion.html", "search.html", "reference/heuristic.html"];

async function look_at(views, name) {
    for (const view of views) {
        if (view.scheme === "dark" && !dark_pages.includes(name)) continue;
        await open(view, name);
        const { page, scheme, width, place } = view;
        const overflow = await page.evaluate(() => document.documentElement.scrollWidth - window.innerWidth);
        if (overflow > 1) fail(place, `is ${overflow} pixels wider than the window`);
        if (width > 1000) await find_inaccessible(view, axe);
        if (shots && width > 1000) {
            const file = name.replaceAll("/", "_").replace(".html", `-${scheme}-${width}.png`);
            await page.screenshot({ path: path.join(shots, file) });
        }
        if (scheme === "light" && width === 1280) {
            ids.set(name, new Set(await page.$$eval("[id]", (all) => all.map((e) => e.id))));
            for (const href of await page.$$eval("a[href]", (all) => all.map((e) => e.href))) {
                if (!href.startsWith("file:")) continue;
                const target = new URL(href);
                const file = fileURLToPath(new URL(target.pathname, "file:"));
                links.push([name, path.relative(site, file), decodeURIComponent(target.hash.slice(1))]);
            }
        }
    }
}
// How long a reader waits who has looked at a page before.
const reader = await window_of("light", 1280);
const { page } = reader;
await open(reader, "index.html");
let slowest = { ms: 0 };
for (const name of pages) {
    await open(reader, name);
    const ms = await page.evaluate(() => performance.getEntriesByType("navigation")[0].loadEventEnd);
    if (ms > slowest.ms) slowest = { ms, name };
}

// Two at a time.
const left = pages.values();
await Promise.all([left, left].map(async (mine) => {
    const views = [await window_of("light", 1280), await window_of("light", 390), await window_of("dark", 1280)];
    for (const name of mine) await look_at(views, name);
}));
for (const [from, to, id] of links) {
    if (!ids.has(to)) {
        if (!existsSync(path.join(site, to))) fail(from, `links to ${to}, which is not there`);
    } else if (id && !ids.get(to).has(id)) {
        fail(from, `links to ${to}#${id}, which is not there`);
    }
}

// What a reader does.
await open(reader, "index.html");
await page.fill("input[name=q]", "roulette");
await page.press("input[name=q]", "Enter");
await page.waitForSelector("#search-results li", { timeout: 10000 }).catch(() => fail("search", "finds nothing"));
await open(reader, "index.html");
const picture = page.locator("button.enlarges").first();
const small = await picture.locator("img").boundingBox();
await picture.click();
const large = await page.locator("dialog.enlarged img").boundingBox();
if (!large || large.width <= small.width) fail(reader.place, "a picture does not enlarge");
await page.keyboard.press("Escape");
if (await page.locator("dialog.enlarged").isVisible()) fail(reader.place, "an enlarged picture stays");
await open(reader, "recursion.html");
if ((await page.locator(".katex").count()) === 0) fail(reader.place, "no formula is rendered");
await browser.close();
if (pages.length < 10) fail(site, `has ${pages.length} pages only`);
console.log(`${pages.length} pages, ${links.length} links; slowest to load: ${slowest.name}, ${Math.round(slowest.ms)} ms`);
finish();
