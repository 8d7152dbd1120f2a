// The page of Veach's plates to play with: hands what a reader sets to the program, and shows its pictures.
document.addEventListener("DOMContentLoaded", async () => {
    const by_id = (id) => document.getElementById(id);
    const setting = { counts: [4, 1], beta: 2, roughness: 1, shown: "balance" };
    const chosen = { x: 95, y: 127 };
    const [width, height] = [240, 180];
    const surfaces = ["the smoothest plate", "the second plate", "the third plate", "the roughest plate", "the floor", "the wall"];
    const program = await play_plates();

    // ---- Pictures: row by row, for a part of each frame, so that the page answers meanwhile ----

    const pictures = ["picture", "weights"].map((id) => ({
        context: by_id(id).querySelector("canvas").getContext("2d"),
        pixels: program[`_plates_${id}`](),
    }));
    function put(i, from, to) {
        if (to <= from) return;
        const rows = program.HEAPU8.slice(pictures[i].pixels + 4 * width * from, pictures[i].pixels + 4 * width * to);
        pictures[i].context.putImageData(new ImageData(new Uint8ClampedArray(rows.buffer), width, to - from), 0, from);
    }
    let row, is_painting = false; // row: the next one; those of the weights come after those of the picture
    function paint() {
        is_painting = true;
        const start = row, enough = performance.now() + 12;
        while (row < 2 * height && performance.now() < enough) {
            if (row < height) program._show_row(row);
            else program._weigh_row(row - height);
            ++row;
        }
        const of_weights = [Math.max(0, start - height), row - height];
        if (setting.shown !== "optimal") put(0, start, Math.min(row, height));
        else put(0, ...of_weights);
        put(1, ...of_weights);
        if (row < 2 * height) return requestAnimationFrame(paint);
        is_painting = false;
        by_id("play").dataset.painted = JSON.stringify(setting);
    }

    // ---- The chosen pixel ----

    const rows = new Map();
    for (const { value: name } of by_id("heuristic").options) {
        const line = by_id("variances").insertRow(), canvas = document.createElement("canvas");
        line.insertCell().textContent = name;
        [canvas.width, canvas.height] = [64, 4];
        line.insertCell().append(canvas);
        rows.set(name, { line, canvas, cells: [1, 2, 3, 4].map(() => line.insertCell()) });
    }
    const short = (x, digits = 3) => (x === 0 ? "0" : x >= 10 ** digits || x < 1e-3 ?
        x.toExponential(digits - 1).replace("e+", "e") : x.toPrecision(digits));
    function explain() {
        const result = JSON.parse(program.ccall("explain_pixel", "string", ["number", "number"], [chosen.x, chosen.y]));
        const is_none = setting.counts[0] + setting.counts[1] === 0;
        by_id("chosen").textContent = `Pixel ${chosen.x}, ${chosen.y} shows ` + (result.surface < 0 ? "a light: nothing is estimated there." :
            `${surfaces[result.surface]}${result.roughness > 0 ? `, roughness ${Number(result.roughness.toPrecision(2))}` : ""}. ` +
            (is_none ? "No technique takes samples, and the picture is black." : `The mean of its channels is ${short(result.mean)}.`));
        for (const [name, { line, canvas, cells }] of rows) {
            const context = canvas.getContext("2d"), found = result.estimators?.find((e) => e.name === name);
            line.classList.toggle("shown", name === setting.shown);
            context.clearRect(0, 0, canvas.width, canvas.height);
            if (!found || is_none) {
                cells.forEach((cell) => { cell.textContent = "–"; });
                Object.keys(line.dataset).forEach((key) => delete line.dataset[key]);
                continue;
            }
            const image = context.createImageData(canvas.width, canvas.height);
            found.passes.forEach((x, i) => image.data.set([0, 0, 0].fill((127.5 * x) / result.mean).concat(255), 4 * i));
            context.putImageData(image, 0, 0);
            const error = (100 * Math.sqrt(found.variance)) / result.mean;
            cells[0].textContent = short(found.variance);
            cells[1].textContent = `${error >= 1e4 ? error.toExponential(1).replace("e+", "e") : error >= 100 ? error.toFixed(0) : error.toPrecision(2)} %`;
            cells[2].textContent = `${short(found.seen)} ± ${short(found.uncertain, 2)}`;
            cells[3].textContent = `${(100 * found.weight).toFixed(1)} %`;
            Object.assign(line.dataset, { variance: found.variance, seen: found.seen, uncertain: found.uncertain,
                seenMean: found.seen_mean, mean: result.mean, weight: found.weight });
        }
        for (const marker of document.querySelectorAll("#play .marker")) {
            marker.style.left = `${(100 * (chosen.x + 0.5)) / width}%`;
            marker.style.top = `${(100 * (chosen.y + 0.5)) / height}%`;
        }
        by_id("play").dataset.setting = JSON.stringify({ ...setting, ...chosen });
    }

    // ---- What a reader sets ----

    // At most once a frame.
    let is_asked = false, is_changed = false;
    function ask(changes_pictures) {
        is_changed ||= changes_pictures;
        if (is_asked) return;
        is_asked = true;
        requestAnimationFrame(() => {
            is_asked = false;
            if (is_changed) {
                program.ccall("set_plates", null, ["string"], [JSON.stringify(setting)]);
                delete by_id("play").dataset.painted;
                row = 0;
                if (!is_painting) requestAnimationFrame(paint);
                is_painting = true;
            }
            is_changed = false;
            explain();
        });
    }
    function choose(x, y) {
        chosen.x = Math.min(Math.max(Math.floor(x), 0), width - 1);
        chosen.y = Math.min(Math.max(Math.floor(y), 0), height - 1);
        ask(false);
    }
    for (const id of ["picture", "weights"]) {
        const frame = by_id(id);
        const follow = (event) => {
            const box = frame.querySelector("canvas").getBoundingClientRect();
            choose(((event.clientX - box.left) / box.width) * width, ((event.clientY - box.top) / box.height) * height);
        };
        frame.addEventListener("pointerdown", (event) => {
            frame.setPointerCapture(event.pointerId);
            event.preventDefault();
            frame.focus();
            follow(event);
        });
        frame.addEventListener("pointermove", (event) => frame.hasPointerCapture(event.pointerId) && follow(event));
        frame.addEventListener("keydown", (event) => {
            const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
            if (!step) return;
            event.preventDefault();
            const times = event.shiftKey ? 10 : 1;
            choose(chosen.x + times * step[0], chosen.y + times * step[1]);
        });
    }
    const inputs = {
        count0: (x) => { setting.counts[0] = x; },
        count1: (x) => { setting.counts[1] = x; },
        beta: (x) => { setting.beta = x; },
        roughness: (x) => { setting.roughness = 2 ** x; },
    };
    for (const [id, set] of Object.entries(inputs)) {
        const input = by_id(id);
        input.value = { count0: setting.counts[0], count1: setting.counts[1], beta: setting.beta, roughness: 0 }[id];
        const show = () => {
            const value = id === "roughness" ? `× ${Number((2 ** input.value).toPrecision(3))}` : input.value;
            input.previousElementSibling.textContent = value;
            if (id === "roughness") input.setAttribute("aria-valuetext", value);
        };
        show();
        input.addEventListener("input", () => {
            set(Number(input.value));
            show();
            ask(true);
        });
    }
    by_id("heuristic").value = setting.shown;
    by_id("heuristic").addEventListener("change", () => {
        setting.shown = by_id("heuristic").value;
        ask(true);
    });
    ask(true);
});
