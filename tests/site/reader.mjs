// A reader's browser, for the checks of the site. What goes wrong in it is counted.
import path from "node:path";
import { pathToFileURL } from "node:url";
import { chromium } from "playwright-core";

let failures = 0;
export function fail(place, what) {
    ++failures;
    console.error(`${place}: ${what}`);
}
// The last line of a check.
export function finish() {
    if (failures) {
        console.error(`${failures} failures`);
        process.exit(1);
    }
}

export function launch(...more) {
    return chromium.launch({
        executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
        args: ["--no-sandbox", ...more],
    });
}

// A window on the site, and the page that it shows.
export async function window_of(browser, site, colorScheme, width) {
    const page = await browser.newPage({ colorScheme, viewport: { width, height: 900 } });
    const view = { page, site, scheme: colorScheme, width, place: "" };
    page.on("pageerror", (error) => fail(view.place, error.message));
    page.on("console", (message) => message.type() === "error" && fail(view.place, message.text()));
    page.on("requestfailed", (request) => fail(view.place, `not found: ${request.url()}`));
    page.on("request", (request) => {
        if (!request.url().startsWith(pathToFileURL(site).href) && !/^(data|blob):/.test(request.url()))
            fail(view.place, `asks for ${request.url()}`);
    });
    return view;
}
export async function open(view, name) {
    view.place = `${name} (${view.scheme}, ${view.width})`;
    await view.page.goto(pathToFileURL(path.join(view.site, name)).href, { waitUntil: "load" });
}

// What axe finds serious in the page as it is now.
export async function find_inaccessible(view, axe) {
    await view.page.evaluate(axe.source);
    // Style sheets of files cannot be read by scripts of others.
    const found = await view.page.evaluate(
        () => window.axe.run(document, { resultTypes: ["violations"], preload: false }));
    for (const v of found.violations.filter((v) => ["serious", "critical"].includes(v.impact)))
        fail(view.place, `axe: ${v.id}: ${v.help}: ${v.nodes.length} times, first ${v.nodes[0].html.slice(0, 150)}`);
}
