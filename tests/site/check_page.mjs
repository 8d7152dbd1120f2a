// Drives the page that checks path dumps as a reader would, and compares it with the native program:
//     node check_page.mjs SITE BUILD [FOLDER]
// BUILD is a build folder with the programs lab and check_paths; dumps are made in BUILD/check_page, screenshots in
// FOLDER. The page must say what check_paths says, to the letter: of a dump of each mistake that lab plants, of right
// ones, and of files that are none. Says how many records per second both check.
import axe from "axe-core";
import { execFileSync, spawnSync } from "node:child_process";
import { appendFileSync, existsSync, mkdirSync, readFileSync, rmSync, statSync, truncateSync, writeFileSync } from "node:fs";
import path from "node:path";
import { gzipSync } from "node:zlib";
import { fail, find_inaccessible, finish, launch, open, window_of } from "./reader.mjs";

const [site, build, shots] = process.argv.slice(2).map((p) => path.resolve(p));
const lab = path.join(build ?? "", "examples/lab/lab");
const check_paths = path.join(build ?? "", "examples/check_paths/check_paths");
if (!build || ![path.join(site, "check.html"), lab, check_paths].every(existsSync)) {
    console.error("usage: node check_page.mjs SITE BUILD [FOLDER]; SITE has check.html, BUILD has lab and check_paths");
    process.exit(2);
}
const folder = path.join(build, "check_page");
rmSync(folder, { recursive: true, force: true });
mkdirSync(folder, { recursive: true });
if (shots) mkdirSync(shots, { recursive: true });

// ---- Dumps ----

const on_surfaces = { scene: "mixed", algorithm: "ups", scale: "0.01" };
const in_media = { scene: "milk", algorithm: "upbp", scale: "0.01", "radius-3d": "0.03", "radius-1d": "0.005", "beam-walks": "100" };
const of_media = ["distance_omitted", "distance_twice", "pass_is_density", "short_is_long", "beam_sine", "beam_count",
    "family_radius", "boundary_vertex"];
// What some mistakes need to show.
const needs = {
    power_overflow: { scale: "1" },
    subpath_caps: { "max-camera-vertices": "4", "max-light-vertices": "4" },
    maximum_tie: { heuristic: "maximum", radius: "0.06" },
    merge_roulette: { radius: "0.06" },
    splitting_omitted: { algorithm: "bpt", roulette: "adjoint" },
};

function dump(name, options) {
    const file = path.join(folder, `${name}.jsonl`);
    const all = { size: "48", samples: "1", "light-samples": "2", "radius-alpha": "1", threads: "1", dump: file,
        output: path.join(folder, "images"), ...options };
    const words = Object.entries(all).flatMap(([name, value]) => [`--${name}`, value]);
    execFileSync(lab, ["--no-checks", ...words], { stdio: ["ignore", "ignore", "inherit"] });
    return file;
}
const dump_with = (mistake) => dump(mistake, { ...(of_media.includes(mistake) ? in_media : on_surfaces), ...needs[mistake],
    mistake, "dump-limit": "1968" });
function file_of(name, content) {
    const file = path.join(folder, name);
    writeFileSync(file, content);
    return file;
}
const mistakes = execFileSync(lab, ["--help"], { encoding: "utf8" }).match(/--mistake TEXT:\{([^}]*)\}/)[1].split(",");

// ---- Both programs ----

// Which error in a line that is no JSON is seen first depends on the processor: simdjson's code for each. The page has
// that for SSE 4.2.
function native(file, simdjson = "") {
    const start = performance.now();
    const done = spawnSync(check_paths, [path.basename(file)], { cwd: path.dirname(file), encoding: "utf8",
        env: { ...process.env, ...(simdjson && { SIMDJSON_FORCE_IMPLEMENTATION: simdjson }) } });
    return { status: done.status, report: done.stdout, complaint: done.stderr, seconds: (performance.now() - start) / 1000 };
}

// What the page says after `hand_over`.
async function read_page(page, hand_over) {
    await hand_over();
    await page.waitForSelector("#check[data-status]", { timeout: 120000 });
    return page.evaluate(() => {
        const { status, records, seconds, memory } = document.getElementById("check").dataset;
        const [state, report] = ["state", "report"].map((id) => document.getElementById(id).textContent);
        return { status: Number(status), report, state, records: Number(records), seconds: Number(seconds), memory: Number(memory) };
    });
}
const choose = (page, file) => page.setInputFiles("#dump", file);
// As a reader who looks at the page first: for its first second a browser does much else.
async function choose_later(page, file) {
    await page.waitForTimeout(1500);
    await choose(page, file);
}
// As by a reader's mouse.
async function drop(page, file) {
    const box = await page.locator("#drop").boundingBox();
    const session = await page.context().newCDPSession(page);
    for (const type of ["dragEnter", "dragOver", "drop"])
        await session.send("Input.dispatchDragEvent", { type, x: box.x + box.width / 2, y: box.y + 20,
            data: { items: [], files: [file], dragOperationsMask: 1 } });
}

const browser = await launch();
const view = await window_of(browser, site, "light", 1280);
const { page } = view;

// The page says what the native program says.
async function compare(file, hand_over = choose, simdjson = "") {
    await open(view, "check.html");
    view.place = path.basename(file);
    const ours = await read_page(page, () => hand_over(page, file)), right = native(file, simdjson);
    for (const key of ["status", "report"])
        if (ours[key] !== right[key]) fail(view.place, `the page's ${key} is\n${ours[key]}\nand the native one\n${right[key]}`);
    if (right.complaint && ours.state !== right.complaint)
        fail(view.place, `the page says\n${ours.state}\nand the native program\n${right.complaint}`);
    return { ...ours, native_seconds: right.seconds, complaint: right.complaint };
}
async function shoot(name) {
    if (shots) await page.screenshot({ path: path.join(shots, `${name}.png`), fullPage: true });
}

// ---- Mistakes ----

let drawn = 0;
for (const mistake of mistakes) {
    const { report } = await compare(dump_with(mistake));
    const named = [...report.matchAll(/^suspect: (\w+)/gm)].map((found) => found[1]);
    if (!named.includes(mistake)) console.log(`${mistake}: named ${named}`);
    const headings = await page.$$eval("#suspects h2", (all) => all.map((e) => e.textContent));
    if (named.some((name, i) => !headings[i]?.startsWith(`suspect: ${name}`)))
        fail(mistake, `suspects are ${named}, the page shows ${headings}`);
    const lines = [...report.matchAll(/^  line \d+: weight .* with the mistake/gm)].length;
    const figures = await page.$$eval("figure.path", (all) => all.filter((e) => {
        const places = [...e.querySelectorAll("circle, rect")].map((x) => x.getBoundingClientRect());
        const frame = e.querySelector("svg").getBoundingClientRect();
        return places.length >= 2 && places.every((x) => x.left >= frame.left && x.right <= frame.right);
    }).length);
    if (figures !== lines) fail(mistake, `${figures} of ${lines} examples are drawn`);
    drawn += figures;
    if (mistake === "roulette_one_sided" || mistake === "beam_count") {
        await find_inaccessible(view, axe);
        await shoot(`check_page-${mistake}`);
    }
}
if (drawn < mistakes.length) fail("examples", `only ${drawn} are drawn`);

// ---- Right dumps, and files that are none ----

const right = dump("right", { ...on_surfaces, "dump-limit": "20000" });
const text = readFileSync(right), compressed = gzipSync(text);
const small = await compare(right, drop);
if (small.status !== 0) fail("right.jsonl", `status ${small.status}`);
const lines = [];
async function expect_complaint(file, with_what) {
    const { complaint } = await compare(file, choose, "westmere");
    if (native(file).complaint !== complaint) fail(path.basename(file), "another complaint on this processor");
    if (!complaint.includes(with_what) || complaint.split("\n").length !== 2)
        fail(path.basename(file), `says "${complaint}", not "${with_what}"`);
    lines.push(complaint);
}
await compare(file_of("right.jsonl.gz", compressed));
await compare(file_of("members.jsonl.gz", Buffer.concat([compressed, compressed])), drop);
await expect_complaint(file_of("cut_off.jsonl.gz", compressed.subarray(0, compressed.length / 2)), "the compressed data is cut off");
await expect_complaint(file_of("followed.jsonl.gz", Buffer.concat([compressed, Buffer.from("more")])), "something else follows");
await expect_complaint(file_of("damaged.jsonl.gz", compressed.map((b, i) => (i === 50000 ? b ^ 0xff : b))), "cannot be read");
await expect_complaint(file_of("empty.jsonl", ""), "'empty.jsonl' has no records");
await expect_complaint(file_of("wide.jsonl", Buffer.from(text.toString().slice(0, 5000), "utf16le")), "UTF-16");
await compare(file_of("cut_off.jsonl", text.subarray(0, text.length - 100)));
let random = 1;
const noise = file_of("noise", Uint8Array.from({ length: 8 << 20 }, () => (random = (random * 48271) % 2147483647) & 0xff));
truncateSync(noise, 2 ** 30); // 1 GiB
await expect_complaint(noise, "lines are no records");
const zeros = file_of("zeros", "");
truncateSync(zeros, 1200 << 20);
await expect_complaint(zeros, "a line is longer than 1 GiB");
process.stdout.write(lines.join(""));

// ---- What a reader may do besides ----

// A file that changes after it was chosen.
const changing = file_of("changing.jsonl", text);
await open(view, "check.html");
await read_page(page, () => choose(page, changing));
appendFileSync(changing, text);
const broken = await read_page(page, () => page.evaluate(() => {
    document.getElementById("check").removeAttribute("data-status");
    document.getElementById("dump").dispatchEvent(new Event("change"));
}));
if (broken.status !== 2 || !broken.state.includes("'changing.jsonl' cannot be read")) fail("changing.jsonl", broken.state);

// A browser that gives each block a buffer of its own.
const old = await window_of(browser, site, "light", 1280);
await old.page.addInitScript(() => {
    const { getReader } = ReadableStream.prototype;
    ReadableStream.prototype.getReader = function (options) {
        if (options?.mode) throw new TypeError("no such mode");
        return getReader.call(this);
    };
});
await open(old, "check.html");
const without = await read_page(old.page, () => choose(old.page, path.join(folder, "members.jsonl.gz")));
if (without.report !== native(path.join(folder, "members.jsonl.gz")).report) fail("older browser", without.report);
await old.page.close();

await open(view, "check.html");
await choose(page, zeros);
await page.waitForFunction(() => document.getElementById("progress").value > 0.1);
await page.click("#stop");
const stopped = await page.textContent("#state");
if (stopped !== "Stopped." || await page.isVisible("#stop")) fail("stop", stopped);
const after = await read_page(page, () => choose(page, right));
if (after.status !== 0) fail("after a stop", after.state);

// ---- Speed and memory ----

const large = path.join(folder, "large.jsonl");
while (!existsSync(large) || statSync(large).size < 120e6) appendFileSync(large, text);
const tries = [];
for (let i = 0; i < 3; ++i) tries.push(await compare(large, choose_later));
const [much] = tries;
if (much.memory > small.memory + (4 << 20))
    fail("memory", `${much.memory} bytes after ${statSync(large).size}, ${small.memory} after ${text.length}`);
// The best of a few: others work on this machine, too.
const [ours, theirs] = ["seconds", "native_seconds"].map((key) => Math.min(...tries.map((one) => one[key])));
console.log(`${mistakes.length} mistakes, ${drawn} examples drawn. ${much.records} records: ${Math.round(much.records / ours)} per ` +
    `second in the page, ${(theirs / ours).toFixed(2)} times the ${Math.round(much.records / theirs)} of the native program; ` +
    `memory ${(much.memory / 2 ** 20).toFixed(0)} MiB`);
await browser.close();
rmSync(folder, { recursive: true });
finish();
