// What the checks of the pages to play with begin with: a page as a reader finds it, and the native program that knows
// what it must show.
import { execFileSync } from "node:child_process";
import { existsSync, mkdirSync } from "node:fs";
import path from "node:path";
import { fileURLToPath } from "node:url";
import { fail, launch, open, window_of } from "./reader.mjs";

export function expect(what, is_so) {
    if (!is_so) fail(what, "is not so");
}

// Opens NAME.html of the site, and compiles NAME_oracle.cpp, as the command line says: SITE BUILD [FOLDER].
export async function play_with(name) {
    const [site, build, shots] = process.argv.slice(2).map((p) => path.resolve(p));
    if (!build || ![path.join(site, `${name}.html`), build].every(existsSync)) {
        console.error(`usage: node ${name}_page.mjs SITE BUILD [FOLDER]; SITE has ${name}.html`);
        process.exit(2);
    }
    if (shots) mkdirSync(shots, { recursive: true });
    const oracle = path.join(build, `${name}_oracle`);
    execFileSync(process.env.CXX ?? "g++", ["-std=c++17", "-O2", "-Wall", "-Wextra", "-Werror",
        path.join(path.dirname(fileURLToPath(import.meta.url)), `${name}_oracle.cpp`), "-o", oracle]);
    const browser = await launch();
    const view = await window_of(browser, site, "light", 1280);
    await open(view, `${name}.html`);
    await view.page.waitForSelector("#play[data-setting]", { timeout: 20000 });
    return {
        site, shots, browser, view, page: view.page,
        setting: () => view.page.evaluate(() => JSON.parse(document.getElementById("play").dataset.setting)),
        // Once the page has answered what was done: it does that in the next frame.
        answered: () => view.page.evaluate(
            () => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))),
        // What the native program prints for some words: of each name the numbers behind it.
        native: (...words) => Object.fromEntries(execFileSync(oracle, words.map(String), { encoding: "utf8" }).trim().split("\n")
            .map((line) => line.split(" ")).map(([of, ...numbers]) => [of, numbers.map(Number)])),
    };
}
