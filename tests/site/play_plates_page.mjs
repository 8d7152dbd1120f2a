// Plays on Veach's plates as a reader would, and compares the variances that the page shows with those of a native
// program that is written from the formulas alone, play_plates_oracle.cpp:
//     node play_plates_page.mjs SITE BUILD [FOLDER]
// The program is compiled into BUILD; screenshots go to FOLDER.
import axe from "axe-core";
import path from "node:path";
import { expect, play_with } from "./play.mjs";
import { fail, find_inaccessible, finish, open, window_of } from "./reader.mjs";

const { site, shots, browser, view, page, setting, answered, native: oracle } = await play_with("play_plates");

const [width, height] = [240, 180];
const table = () => page.evaluate(() => Object.fromEntries([...document.querySelectorAll("#variances tr")].map((row) =>
    [row.cells[0].textContent, Object.fromEntries(Object.entries(row.dataset).map(([key, x]) => [key, Number(x)]))])));
const native = ({ x, y, counts, beta, roughness }) => oracle(x, y, ...counts, beta, roughness);

// Both quadratures are right to about 1e-8 of the second moment. A variance that is a small part of it loses digits:
// at worst 1e-5 was seen of one that is a millionth. Weights that jump, and shadows of plates, cost the native program
// a part of some cells.
const tolerance = 1e-4;
let farthest = 0, compared = 0;
async function compare(what) {
    await answered();
    view.place = what;
    const ours = await table(), { mean: [mean], ...right } = native(await setting());
    for (const [name, [variance, weight]] of Object.entries(right)) {
        const off = Math.abs(ours[name].variance / variance - 1);
        if (!(off <= tolerance)) fail(what, `variance of ${name} is ${ours[name].variance}, not ${variance}`);
        if (!(Math.abs(ours[name].weight - weight) <= 1e-5)) fail(what, `BSDF's part of ${name} is ${ours[name].weight}, not ${weight}`);
        if (!(Math.abs(ours[name].mean / mean - 1) <= 1e-6)) fail(what, `the mean is ${ours[name].mean}, not ${mean}`);
        farthest = Math.max(farthest, off);
        ++compared;
    }
    const all = Object.values(ours).map((of) => of.variance);
    if (all.length !== 6) fail(what, `compares ${all.length} estimators`);
    if (ours.optimal.variance > (1 + 1e-7) * Math.min(...all)) fail(what, "optimal weights are not the best");
    return ours;
}

// By the mouse, as the picture lies on the screen.
async function click(picture, x, y) {
    await page.locator(`#${picture}`).scrollIntoViewIfNeeded();
    const box = await page.locator(`#${picture} canvas`).boundingBox();
    await page.mouse.click(box.x + ((x + 0.5) / width) * box.width, box.y + ((y + 0.5) / height) * box.height);
    await page.waitForFunction(([x, y]) => {
        const at = JSON.parse(document.getElementById("play").dataset.setting);
        return at.x === x && at.y === y;
    }, [x, y], { timeout: 5000 }).catch(() => fail(picture, `a click does not choose ${x}, ${y}`));
}
async function slide(input, key, times) {
    await page.focus(`#${input}`);
    for (let i = 0; i < times; ++i) await page.keyboard.press(key);
}
// Counts of both techniques, from wherever they are.
async function take(bsdf, light) {
    await slide("count0", "Home", 1);
    await slide("count0", "ArrowRight", bsdf);
    await slide("count1", "Home", 1);
    await slide("count1", "ArrowRight", light);
}
async function painted() {
    await answered(); // until then the pictures are those of what was set before
    await page.waitForFunction(() => {
        const { painted, setting } = document.getElementById("play").dataset;
        if (!painted) return false;
        const { x, y, ...pictures } = JSON.parse(setting);
        return painted === JSON.stringify(pictures);
    }, null, { timeout: 120000 });
}
const colors = (picture, x, y, w, h) => page.evaluate(([id, ...box]) =>
    [...document.querySelector(`#${id} canvas`).getContext("2d").getImageData(...box).data], [picture, x, y, w, h]);
// How far neighbors in a picture are apart, of 255.
async function grain(x, y, w, h) {
    const data = await colors("picture", x, y, w, h);
    let sum = 0, count = 0;
    for (let i = 0; i < data.length - 4; ++i)
        if (i % 4 < 3 && (i >> 2) % w < w - 1) sum += (data[i] - data[i + 4]) ** 2, ++count;
    return Math.sqrt(sum / count);
}
const error = ({ variance, mean }) => (100 * Math.sqrt(variance)) / mean; // in percent
function expect_errors(what, found, said) {
    for (const [name, percent] of Object.entries(said)) {
        const digits = 10 ** (Math.floor(Math.log10(percent)) - 1); // the text has two
        expect(`${what}: ${name} has ${percent} %, found ${error(found[name])}`, Math.abs(error(found[name]) - percent) <= 0.5001 * digits);
    }
}

// ---- What the page says that can be tried ----

const start = await compare("start");
expect_errors("start", start, { balance: 41, power: 17, maximum: 7.8, optimal: 6.9 });
await slide("count0", "Home", 1);
const alone = await compare("no BSDF samples");
expect_errors("no BSDF samples", alone, { balance: 7.8 });
expect("optimal weights lose nothing by BSDF samples", start.optimal.variance < alone.optimal.variance);

const [specks, gone] = [[35, 148, 22, 8], [187, 79, 20, 7]]; // small light in the roughest plate, large one in the smoothest
await take(8, 0);
await painted();
await click("picture", 197, 82);
expect_errors("BSDF samples alone", await compare("BSDF samples alone"), { balance: 0.22 });
const by_bsdf = [await grain(...specks), await grain(...gone)];
await take(0, 2);
await painted();
expect_errors("light samples alone", await compare("light samples alone"), { balance: 8600 });
const by_light = [await grain(...specks), await grain(...gone)];
expect(`BSDF samples leave specks of small lights: ${by_bsdf}, ${by_light}`, by_bsdf[0] > 5 * by_light[0]);
expect(`light samples lose the large light: ${by_light}, ${by_bsdf}`, by_light[1] > 5 * by_bsdf[1]);
const missing = await colors("picture", ...gone);
expect("it is nearly gone", missing.filter((x, i) => i % 4 === 2 && x < 16).length > 0.8 * (missing.length / 4));

await take(4, 1);
await page.selectOption("#heuristic", "power");
await click("weights", 145, 104);
const middle = await compare("where lobe and light are alike");
expect("balance is better than power", middle.balance.variance < middle.power.variance);
await click("picture", 46, 152);
expect_errors("the small light in the roughest plate", await compare("small light"), { power: 1.4, balance: 7.7 });

await click("picture", 95, 127);
await slide("beta", "ArrowLeft", 10);
const one = await compare("beta 1");
expect("power with beta 1 is balance", Math.abs(one.power.variance / one.balance.variance - 1) < 1e-12);
await slide("beta", "End", 1);
const eight = await compare("beta 8");
expect("power with beta 8 is next to maximum", eight.power.variance < 1.2 * eight.maximum.variance);
await painted();
const sharp = await colors("weights", 0, 78, width, 80);
await slide("beta", "Home", 1);
const tenth = await compare("beta 0.1");
expect("power with beta 0.1 is on the way to average",
    tenth.power.variance > 2 * tenth.balance.variance && tenth.power.variance < tenth.average.variance);
await painted();
const blurred = await colors("weights", 0, 78, width, 80);
const white = (data) => data.filter((x, i) => i % 4 === 1 && x > 200).length; // as much of both techniques
expect(`borders of weights are sharp for beta 8: ${white(sharp)}, ${white(blurred)}`, white(sharp) < 0.25 * white(blurred));
const plates = [40, 120, 110, 40];
const with_specks = await grain(...plates);
await slide("beta", "ArrowRight", 19);
await painted();
const without = await grain(...plates);
expect(`specks with beta 0.1, fewer with 2: ${with_specks}, ${without}`, with_specks > 1.5 * without);

await page.selectOption("#heuristic", "optimal");
await click("picture", 197, 82);
const mirror = await compare("optimal");
expect_errors("optimal", mirror, { optimal: 0.24, power: 2.6 });
expect("balance, cutoff and maximum are no better than power there",
    ["balance", "cutoff", "maximum"].every((name) => mirror[name].variance > mirror.power.variance));
const { average } = mirror;
expect("average has a variance of 3600, of which passes show little",
    Math.abs(average.variance - 3600) < 50 && average.seen < average.variance / 10);
await painted();
if (shots) await page.screenshot({ path: path.join(shots, "play_plates_page.png"), fullPage: true });

const orange = async () => { // pixels of the plates in which BSDF samples find most
    await painted();
    const data = await colors("weights", 30, 78, 180, 80);
    return data.filter((x, i) => i % 4 === 0 && x > data[i + 2]).length;
};
await page.selectOption("#heuristic", "balance");
await click("picture", 95, 127);
const usual = await orange();
expect("of the usual roughness, 24 %", Math.abs((await compare("as rough as usual")).balance.weight - 0.24) < 0.005);
await slide("roughness", "ArrowRight", 6);
expect("8 times as rough, 0.6 %", Math.abs((await compare("8 times as rough")).balance.weight - 0.006) < 0.0005);
const rough = await orange();
expect(`rougher plates are bluer: ${rough}, ${usual}`, rough < 0.5 * usual);
await slide("roughness", "Home", 1);
expect("an 8th as rough, 82 %", Math.abs((await compare("an 8th as rough")).balance.weight - 0.82) < 0.005);
await slide("roughness", "ArrowRight", 6);

// ---- Every surface, shadows among them, by mouse and keys; and whether passes and pictures have these variances ----

const bar = (x) => [[0.15, 0.33, 0.74], [0.95, 0.95, 0.95], [0.91, 0.44, 0]].map((color, i) => // blue to orange
    color.map((c) => 255 * c * Math.max(0, 1 - Math.abs(2 * x - i)))).reduce((a, b) => a.map((c, i) => c + b[i]));
await painted();
let most = 0;
for (const [x, y] of [[145, 127], [197, 152], [95, 152], [145, 104], [120, 60], [60, 172]]) {
    await click("weights", x, y);
    const what = `pixel ${x}, ${y}`, found = await compare(what);
    for (const [name, { variance, seen, uncertain, mean, seenMean }] of Object.entries(found)) {
        const apart = [(seen - variance) / uncertain, (seenMean - mean) / Math.sqrt(variance / 4096)].map(Math.abs);
        // Of 72 comparisons with standard errors; passes that are rarely large would spoil them, and are not among these.
        if (name !== "average" && !(Math.max(...apart) < 4.5)) fail(what, `passes of ${name} are ${apart} standard errors from what is exact`);
        if (name !== "average") most = Math.max(most, ...apart);
    }
    const shown = await colors("weights", x, y, 1, 1), right = bar(found.balance.weight);
    expect(`${what} has the color ${shown} of its weight, ${right}`, right.every((c, i) => Math.abs(c - shown[i]) < 5));
}
for (const [x, y] of [[9, 81], [223, 117], [222, 107]]) { // floor and wall, where plates and lights hide lights
    await click("picture", x, y);
    await compare(`pixel ${x}, ${y}`);
}

// The picture: errors of pixels over the roots of their variances. The fourth light in the third plate is not too bright
// for its colors to be told apart.
const patch = [190, 123, 13, 7], step = 3; // what is exact is smooth here: every third pixel each way, linear between
const grid = [0, 1, 2].map((row) => [0, 1, 2, 3, 4].map((column) => native(
    { x: patch[0] + step * column, y: patch[1] + step * row, counts: [4, 1], beta: 2, roughness: 1 })));
function exact_at(i, name) {
    const [x, y] = [(i % patch[2]) / step, Math.floor(i / patch[2]) / step], [a, b] = [Math.min(Math.floor(x), 3), Math.min(Math.floor(y), 1)];
    const [[left, right], [below_left, below_right]] = [b, b + 1].map((row) => [a, a + 1].map((column) => grid[row][column][name][0]));
    return (1 - y + b) * ((1 - x + a) * left + (x - a) * right) + (y - b) * ((1 - x + a) * below_left + (x - a) * below_right);
}
// Mean of channels of what a color shows: the page's exposure, tone mapping and sRGB undone.
function shown_by(color) {
    const linear = color.map((c) => c / 255).map((c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4));
    const largest = Math.max(...linear), brightest = -Math.log(1 - Math.min(largest, 0.999));
    return largest > 0 ? linear.reduce((a, b) => a + b) / 3 / largest * (brightest / 1.1) : 0;
}
const spreads = [];
for (const name of ["balance", "power", "maximum", "optimal"]) {
    await page.selectOption("#heuristic", name);
    await painted();
    const data = await colors("picture", ...patch);
    const z = Array.from({ length: patch[2] * patch[3] }, (_, i) =>
        (shown_by(data.slice(4 * i, 4 * i + 3)) - exact_at(i, "mean")) / Math.sqrt(exact_at(i, name)));
    const mean = z.reduce((a, b) => a + b) / z.length, square = z.reduce((a, b) => a + b * b, 0) / z.length;
    spreads.push(square.toFixed(2));
    // Of 91 pixels: both within four standard errors, which are 0.1 and 0.15.
    expect(`the picture by ${name} has the exact variances: ${mean}, ${square}`, Math.abs(mean) < 0.4 && Math.abs(square - 1) < 0.6);
}
await page.selectOption("#heuristic", "balance");

await take(8, 8);
await slide("beta", "ArrowRight", 30);
await page.focus("#picture");
for (const key of ["ArrowUp", "Shift+ArrowLeft", "ArrowDown", "ArrowRight"]) await page.keyboard.press(key);
await compare("keys");
const { x, y } = await setting();
expect(`keys lead to 213, 107, not to ${x}, ${y}`, x === 213 && y === 107);

await click("picture", 210, 30);
expect("a light has no estimate", (await page.textContent("#chosen")).includes("shows a light"));
await take(0, 0);
await click("picture", 95, 127);
expect("without samples there is no light", (await page.textContent("#chosen")).includes("No technique"));
await painted();
expect("without samples the picture is black", (await colors("picture", 95, 127, 1, 1)).slice(0, 3).every((c) => c === 0));

for (const scheme of ["light", "dark"]) {
    const other = await window_of(browser, site, scheme, 1280);
    await open(other, "play_plates.html");
    await other.page.waitForSelector("#play[data-painted]", { timeout: 60000 });
    await find_inaccessible(other, axe);
    if (shots) await other.page.screenshot({ path: path.join(shots, `play_plates-${scheme}.png`), fullPage: true });
}
await browser.close();
console.log(`${compared} variances, the farthest off by ${farthest.toExponential(1)}; passes within ${most.toFixed(1)} standard errors; ` +
    `squared errors of pictures over variances: ${spreads.join(", ")}`);
finish();
