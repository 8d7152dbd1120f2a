// The page that checks a path dump: hands the file to a worker, shows its report and draws the suspects' examples.
document.addEventListener("DOMContentLoaded", () => {
    const [input, drop, state, progress, stop, report, suspects] = [
        "dump", "drop", "state", "progress", "stop", "report", "suspects",
    ].map((id) => document.getElementById(id));
    // From a file, workers can only be made of text that is there already: check_program.js.
    const program = URL.createObjectURL(new Blob([check_program], { type: "text/javascript" }));
    let worker = null, next_worker = null;
    const prepare = () => (next_worker ??= new Worker(program));
    window.addEventListener("load", prepare); // to compile the program takes longer than to check a small dump

    function end() {
        worker?.terminate();
        worker = null;
        prepare();
        progress.hidden = stop.hidden = true;
    }

    function show(file, done, seconds) {
        end();
        const rate = Math.round((done.found.records ?? 0) / Math.max(seconds, 1e-3));
        const verdict = ["All weights agree.", "Some weights are wrong.", "Not all could be checked."][done.status];
        state.textContent = done.complaint || `${verdict} ${megabytes(file.size)} in ` +
            `${seconds.toFixed(1)} s, ${rate} records per second.`;
        report.textContent = done.report;
        report.hidden = !done.report;
        suspects.replaceChildren(...figures_of(done.found));
        Object.assign(document.getElementById("check").dataset, {
            status: done.status, records: done.found.records ?? 0, seconds, memory: done.memory,
        });
    }

    function check(file) {
        end();
        delete document.getElementById("check").dataset.status;
        report.hidden = true;
        suspects.replaceChildren();
        progress.hidden = stop.hidden = false;
        progress.value = 0;
        state.textContent = `Reading ${file.name} ...`;
        const start = performance.now();
        let next_look = start;
        const give_up = (why) => {
            end();
            state.textContent = `'${file.name}' could not be checked: ${why}`;
        };
        const mine = (worker = prepare()), source = source_of(file);
        next_worker = null;
        mine.onmessage = ({ data }) => {
            if (mine !== worker) return; // it was stopped, but had said this before
            if (data.failure) return give_up(data.failure);
            if (data.report !== undefined) return show(file, data, (performance.now() - start) / 1000);
            read_for(mine, source, data.buffer);
            if (performance.now() < next_look) return;
            next_look = performance.now() + 200; // painting takes time from reading
            progress.value = data.read / Math.max(file.size, 1);
            state.textContent = `Reading ${file.name}: ${megabytes(data.read)} of ${megabytes(file.size)}`;
        };
        mine.onerror = (error) => give_up(error.message);
        mine.postMessage({ file });
        for (let i = 0; i < 4; ++i) read_for(mine, source, new ArrayBuffer(1 << 20));
    }

    input.addEventListener("change", () => input.files.length && check(input.files[0]));
    stop.addEventListener("click", () => {
        end();
        state.textContent = "Stopped.";
    });
    drop.addEventListener("dragover", (event) => event.preventDefault());
    for (const [name, is_over] of [["dragenter", true], ["dragleave", false], ["drop", false]])
        drop.addEventListener(name, () => drop.classList.toggle("over", is_over));
    drop.addEventListener("drop", (event) => {
        event.preventDefault();
        if (event.dataTransfer.files.length) check(event.dataTransfer.files[0]);
    });
});

// What a worker checks while it is read. The stream must be kept: Chromium forgets who waits for one that nobody has.
function source_of(file) {
    const stream = file.stream();
    try {
        return { stream, reader: stream.getReader({ mode: "byob" }) };
    } catch {
        return { stream, reader: stream.getReader() }; // an older browser: each block comes in a buffer of its own
    }
}

// Reads the next block for a worker. Few buffers go round: new memory for each block takes as long as reading.
async function read_for(worker, { reader }, buffer) {
    try {
        const { done, value } = await reader.read(new Uint8Array(buffer));
        worker.postMessage(done ? { end: true } : { block: value }, done ? [] : [value.buffer]);
    } catch {
        worker.postMessage({ broken: true }); // a folder, or a file that has changed meanwhile
    }
}

function megabytes(bytes) {
    return `${(bytes / 1e6).toFixed(1)} MB`;
}

function element(name, attributes = {}, ...children) {
    const e = document.createElement(name);
    Object.assign(e, attributes);
    e.append(...children);
    return e;
}

// ---- Suspects ----

function figures_of(found) {
    const by_line = new Map((found.paths ?? []).map((path) => [path.line, path]));
    const number = (x) => (x === null ? "no number" : Number(x.toPrecision(9)));
    const shown = [];
    for (const suspect of found.suspects ?? []) {
        const where = suspect.where ? `, ${suspect.where}` : "";
        shown.push(element("h2", { textContent: `suspect: ${suspect.identifier}${where}` }));
        shown.push(element("p", { textContent: `${suspect.what} ${suspect.advice}` }));
        for (const e of suspect.examples) {
            const text = `Line ${e.line}: weight ${number(e.weight)}, should be ${number(e.right)}, ` +
                `with the mistake ${number(e.predicted)}`;
            if (by_line.has(e.line)) shown.push(figure_of(by_line.get(e.line), text));
        }
    }
    if (shown.length === 0 && by_line.size > 0) {
        shown.push(element("h2", { textContent: "The first wrong weights" }));
        for (const path of by_line.values()) shown.push(figure_of(path, `Line ${path.line}`));
    }
    return shown;
}

function figure_of(path, text) {
    const n = path.vertices.length, s = path.camera_vertices;
    const is_drawn = points_of(path);
    const technique = `${path.technique.replaceAll("_", " ")} of ${n} vertices, ${s} from the camera`;
    return element("figure", { className: "path" }, drawing_of(path, is_drawn, `A path: ${technique}`),
        element("figcaption", { textContent: `${text}; ${technique}.` +
            (is_drawn ? "" : " The dump has no positions: drawn without scale.") }));
}

// ---- Paths ----

const is_vector = (v) => Array.isArray(v) && v.every(Number.isFinite);
const sum = (a, b, t = 1) => a.map((x, i) => x + t * b[i]);
const dot = (a, b) => a.reduce((all, x, i) => all + x * b[i], 0);
const unit = (a) => a.map((x) => x / Math.max(Math.hypot(...a), 1e-300));

// Where the camera's side sees each vertex, and where the light's side sees it, in space; null where unknown.
function points_of(path) {
    const points = path.vertices.map((x) => is_vector(x.position) && [x.position, is_vector(x.photon) ? x.photon : x.position]);
    const last = points.length - 1;
    if (!points.slice(0, last).every(Boolean)) return null;
    const size = Math.max(...points.slice(0, last).map((p) => Math.hypot(...sum(p[0], points[0][0], -1))));
    const { direction } = path.vertices[last];
    if (!points[last] && is_vector(direction)) {
        const far = sum(points[last - 1][1], direction, size > 0 ? size / 2 : 1);
        points[last] = [far, far];
    }
    return points[last] ? points : null;
}

// The two directions in which points spread most, by power iteration.
function plane_of(points) {
    const mean = points.reduce((a, p) => sum(a, p, 1 / points.length), [0, 0, 0]);
    const spread = points.map((p) => sum(p, mean, -1));
    const axes = [];
    for (const start of [[1, 0.7, 0.4], [0.3, 1, -0.8]]) {
        let v = start;
        for (let i = 0; i < 50; ++i) {
            let next = spread.reduce((all, d) => sum(all, d, dot(d, v)), [0, 0, 0]);
            for (const other of axes) next = sum(next, other, -dot(next, other));
            if (Math.hypot(...next) > 1e-12 * Math.hypot(...spread.flat())) v = unit(next);
        }
        for (const other of axes) v = unit(sum(v, other, -dot(v, other)));
        axes.push(v);
    }
    return axes;
}

function drawing_of(path, points, label) {
    const n = path.vertices.length, s = path.camera_vertices, is_merge = path.technique === "merge";
    const [width, height, margin] = [640, 260, 40];
    points ??= path.vertices.map((_, i) => [[i, i % 2 / 2, 0], [i, i % 2 / 2, 0]]);
    const all = points.flat();
    const [across, along] = plane_of(all);
    const flat = (p) => [dot(p, across), dot(p, along)];
    const shadow = all.map(flat);
    const [low, high] = [Math.min, Math.max].map((f) => [0, 1].map((k) => f(...shadow.map((p) => p[k]))));
    const scale = Math.min((width - 2 * margin) / (high[0] - low[0]), (height - 2 * margin) / (high[1] - low[1]));
    const place = (p) => flat(p).map((x, k) =>
        [width, height][k] / 2 + (Number.isFinite(scale) ? scale * (x - (low[k] + high[k]) / 2) : 0));

    const shapes = [];
    for (let i = 0; i + 1 < n; ++i) {
        const [[x1, y1], [x2, y2]] = [place(points[i][1]), place(points[i + 1][0])];
        const is_joint = !is_merge && i === s - 1 && s < n;
        const kind = is_joint ? "joint" : i < s - 1 ? "camera" : "light";
        shapes.push(shape("line", { x1, y1, x2, y2, class: kind }));
    }
    const labels = []; // one for vertices that are close together
    path.vertices.forEach((vertex, i) => {
        const [x, y] = place(points[i][0]), [lx, ly] = place(points[i][1]);
        if (lx !== x || ly !== y) shapes.push(shape("circle", { cx: lx, cy: ly, r: 4, class: "light" }));
        shapes.push(vertex.dirac && i > 0
            ? shape("rect", { x: x - 5, y: y - 5, width: 10, height: 10, class: "dirac" })
            : shape("circle", { cx: x, cy: y, r: 5, class: i < s ? "camera" : "light" }));
        let label = labels.find((other) => Math.abs(other.x - x) < 40 && Math.abs(other.y - y) < 26);
        if (!label) labels.push(label = { x, y, numbers: new Map() });
        const kind = vertex.kind.replace("_", " ");
        label.numbers.set(kind, [...(label.numbers.get(kind) ?? []), i]);
    });
    for (const { x, y, numbers } of labels) {
        const [anchor, shift] = x < 0.2 * width ? ["start", -16] : x > 0.8 * width ? ["end", 16] : ["middle", 0];
        const text = shape("text", { x: x + shift, y: y + (y > height / 2 ? 22 : -12), "text-anchor": anchor });
        text.textContent = [...numbers].map(([kind, of_kind]) => `${ranges_of(of_kind)} ${kind}`).join(", ");
        shapes.push(text);
    }
    const svg = shape("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": label });
    svg.append(...shapes);
    return svg;
}

// "0, 2 to 5" of 0, 2, 3, 4, 5.
function ranges_of(numbers) {
    const ranges = [];
    for (const i of numbers) {
        const last = ranges.at(-1);
        if (last && last[1] === i - 1) last[1] = i;
        else ranges.push([i, i]);
    }
    return ranges.map(([a, b]) => (a === b ? a : b === a + 1 ? `${a}, ${b}` : `${a} to ${b}`)).join(", ");
}

function shape(name, attributes) {
    const e = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) e.setAttribute(key, value);
    return e;
}
