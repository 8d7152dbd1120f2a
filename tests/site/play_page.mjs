// Plays with the techniques as a reader would, and compares the variances that the page shows with those of a native
// program that is written from the formulas alone, play_oracle.cpp:
//     node play_page.mjs SITE BUILD [FOLDER]
// The program is compiled into BUILD; screenshots go to FOLDER.
import axe from "axe-core";
import path from "node:path";
import { expect, play_with } from "./play.mjs";
import { fail, find_inaccessible, finish } from "./reader.mjs";

const { shots, browser, view, page, setting, answered, native: oracle } = await play_with("play");

const variances = () => page.evaluate(() => Object.fromEntries([...document.querySelectorAll("#variances tr")]
    .map((row) => [row.cells[0].textContent, Number(row.cells[2].dataset.variance)])));
function native({ share, f, p, counts, beta }) {
    const numbers = [share, ...[...f, ...p].flatMap((g) => [g.mean, g.deviation]), ...counts, beta];
    return Object.fromEntries(Object.entries(oracle(...numbers)).map(([name, [variance]]) => [name, variance]));
}

// Midpoints are exact for what is smooth. Weights that jump cost a part of a cell, here and there. Of variances beyond
// `infinite` the quadrature sees only a part.
const tolerance = { average: 1e-6, balance: 1e-6, power: 1e-6, cutoff: 1e-4, maximum: 1e-4, optimal: 1e-6 };
const infinite = 1e6;
let farthest = 0;
async function compare(what) {
    await answered();
    view.place = what;
    const ours = await variances(), right = native(await setting());
    for (const [name, expected] of Object.entries(right)) {
        if (ours[name] > infinite && expected > infinite) continue;
        const off = Math.abs(ours[name] - expected);
        if (!(off <= tolerance[name] * expected + 1e-9)) fail(what, `variance of ${name} is ${ours[name]}, not ${expected}`);
        if (expected > 1e-9) farthest = Math.max(farthest, off / expected / tolerance[name]);
    }
    if (ours.optimal > (1 + 1e-9) * Math.min(...Object.values(ours)) + 1e-9) fail(what, "optimal weights are not the best");
    return ours;
}

// By the mouse, as the page lies on the screen.
async function drag(dot, dx, dy) {
    const before = await setting();
    await page.locator(`#${dot}`).scrollIntoViewIfNeeded();
    const box = await page.locator(`#${dot}`).boundingBox();
    const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
    await page.mouse.move(x, y);
    await page.mouse.down();
    await page.mouse.move(x + dx / 2, y + dy / 2, { steps: 3 });
    await page.mouse.move(x + dx, y + dy, { steps: 3 });
    await page.mouse.up();
    const ours = await compare(`dragging ${dot} by ${dx}, ${dy}`);
    const [of, i] = dot, [was, is] = [before, await setting()].map((s) => s[of][i]);
    if (Math.sign(is.mean - was.mean) !== Math.sign(dx) || Math.sign(was.deviation - is.deviation) !== Math.sign(-dy))
        fail(dot, `has not followed: ${JSON.stringify(was)}, ${JSON.stringify(is)}`);
    return ours;
}
async function slide(input, key, times) {
    await page.focus(`#${input}`);
    for (let i = 0; i < times; ++i) await page.keyboard.press(key);
    return compare(`${input}: ${times} ${key}`);
}

// The example of the page on heuristics, with the variances that it says.
const start = await compare("start");
for (const [name, said] of Object.entries({ average: 1.23, balance: 0.0189, power: 0.0507, cutoff: 0.0243, maximum: 0.182, optimal: 0 }))
    expect(`${name} of two Gaussians: ${said}`, Math.abs(start[name] - said) <= 0.006 * said + 1e-9);

// What the page says that can be tried.
await slide("count0", "ArrowRight", 2);
const in_shares = await slide("count1", "ArrowRight", 6);
expect("balance has no variance with counts in f's shares", in_shares.balance < 1e-9 && in_shares.power > 1e-4);
await slide("count0", "ArrowLeft", 2);
const alone = await slide("count1", "ArrowLeft", 7);
expect("all heuristics of one technique are the same", Math.max(...Object.values(alone)) - Math.min(...Object.values(alone)) < 1e-9 * alone.balance);
await slide("share", "End", 1);
const perfect = await slide("count2", "ArrowRight", 1);
expect("power beats balance where one technique is perfect", perfect.power < 0.7 * perfect.balance);
await slide("share", "Home", 1);
await slide("share", "ArrowRight", 40);
await slide("count1", "ArrowRight", 2);

// Everything that can be dragged.
for (const [dot, dx, dy] of [["p0", -40, 20], ["p1", 30, 25], ["f0", -30, -30], ["f1", 40, -15], ["p0", 20, -10]]) {
    const before = await variances(), after = await drag(dot, dx, dy);
    expect(`${dot} changes all variances`, Object.keys(after).every((name) => after[name] !== before[name]));
}
await slide("beta", "ArrowRight", 13);
await page.focus("#p1");
await page.keyboard.press("ArrowRight");
await page.keyboard.press("ArrowUp");
await compare("keys");

// The picture follows: gray is right, and what is farther from it has more variance.
const spread = await page.$$eval("#variances tr", (rows) => rows.map((row) => {
    const canvas = row.querySelector("canvas");
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    let sum = 0;
    for (let i = 0; i < data.length; i += 4) sum += (data[i] / 127.5 - 1) ** 2;
    return { name: row.cells[0].textContent, seen: (4 * sum) / data.length, variance: Number(row.cells[2].dataset.variance) };
}));
const by_variance = spread.sort((a, b) => a.variance - b.variance);
expect(`the least variance looks least: ${JSON.stringify(spread)}`, by_variance[0].seen < by_variance.at(-1).seen);
await page.selectOption("#heuristic", "optimal");
expect("weights are drawn", (await page.locator("#weights polyline").count()) === 3);
await find_inaccessible(view, axe);
if (shots) await page.screenshot({ path: path.join(shots, "play_page.png"), fullPage: true });
await browser.close();
console.log(`the farthest variance is off by ${farthest.toFixed(3)} of what it may be`);
finish();
