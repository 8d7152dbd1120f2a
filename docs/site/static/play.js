// The page of techniques to play with: hands what a reader sets to the program, and draws its answer.
document.addEventListener("DOMContentLoaded", async () => {
    const by_id = (id) => document.getElementById(id);
    const setting = {
        share: 0.3,
        f: [{ mean: 0.425, deviation: 0.1 }, { mean: 0.575, deviation: 0.1 }],
        p: [{ mean: 0.425, deviation: 0.1 }, { mean: 0.575, deviation: 0.1 }],
        counts: [1, 1, 0],
        beta: 2,
    };
    const colours = ["p0", "p1", "p2"];
    const program = await play();
    const compute = () => JSON.parse(program.ccall("play", "string", ["string"], [JSON.stringify(setting)]));

    // ---- Curves ----

    const [width, height, highest] = [640, 280, 8]; // highest: the density at the upper edge
    const to_x = (x) => x * width, to_y = (density) => height - (density / highest) * (height - 20);
    const peak = (g, share) => share / (g.deviation * Math.sqrt(2 * Math.PI));
    const shape = (name, attributes) => {
        const e = document.createElementNS("http://www.w3.org/2000/svg", name);
        for (const [key, value] of Object.entries(attributes)) e.setAttribute(key, value);
        return e;
    };
    const line = (xs, ys, map_y, name) => shape("polyline", {
        class: name,
        points: xs.map((x, i) => `${to_x(x).toFixed(1)},${map_y(ys[i] ?? 0).toFixed(1)}`).join(" "),
    });

    const densities = by_id("densities"), curves = shape("g", {});
    densities.append(curves);
    function draw_densities(result) {
        curves.replaceChildren(line(result.x, result.f, to_y, "f"),
            ...result.p.map((p, i) => line(result.x, p, to_y, colours[i])));
        if (setting.counts[2] === 0) curves.lastChild.classList.add("off");
    }

    function draw_weights(result) {
        const low = -0.5, high = 1.5, map_y = (w) => 200 * (1 - (Math.min(Math.max(w, low), high) - low) / (high - low));
        const level = (w) => shape("line", { x1: 0, x2: width, y1: map_y(w), y2: map_y(w), class: "level" });
        const label = (w) => Object.assign(shape("text", { x: 4, y: map_y(w) - 4 }), { textContent: w });
        const chosen = result.weights[by_id("heuristic").value];
        by_id("weights").replaceChildren(level(0), level(1), label(0), label(1),
            ...chosen.map((w, i) => line(result.x, w, map_y, colours[i])).filter((_, i) => setting.counts[i] > 0));
    }

    // ---- Variances ----

    const rows = new Map();
    function add_row(name) {
        const row = by_id("variances").insertRow(), canvas = document.createElement("canvas");
        row.insertCell().textContent = name;
        [canvas.width, canvas.height] = [128, 8];
        row.insertCell().append(canvas);
        rows.set(name, { canvas, cell: row.insertCell() });
        by_id("heuristic").add(new Option(name, name, false, name === "balance"));
    }
    function draw_variances(result) {
        for (const [name, { canvas, cell }] of rows) {
            const context = canvas.getContext("2d"), image = context.createImageData(canvas.width, canvas.height);
            result.passes[name].forEach((estimate, i) => image.data.set([0, 0, 0].fill(127.5 * estimate).concat(255), 4 * i));
            context.putImageData(image, 0, 0);
            const variance = result.variance[name];
            // Where densities fall faster than f, tails decide that no quadrature sees to their ends.
            cell.textContent = variance < 1e-9 ? "0" : variance > 1e6 ? "> 10⁶" : variance.toPrecision(4);
            cell.dataset.variance = variance;
        }
        by_id("missed").textContent = result.missed < 1e-6 ? "" :
            `No technique samples ${(100 * result.missed).toPrecision(3)} % of f: that is missing in each pass.`;
    }

    // ---- What a reader sets ----

    const dots = [["f", 0], ["f", 1], ["p", 0], ["p", 1]].map(([of, i]) => {
        const dot = shape("circle", { r: 9, class: of === "f" ? "dot f" : `dot p${i}`, id: `${of}${i}`, tabindex: 0,
            role: "slider", "aria-valuemin": 0, "aria-valuemax": 1,
            "aria-label": `Mean of ${of === "f" ? "f's" : "the density"} ${i ? "second" : "first"}${of === "f" ? " peak" : ""}` });
        const share = () => (of === "p" ? 1 : i === 0 ? setting.share : 1 - setting.share);
        const move = (mean, deviation) => {
            Object.assign(setting[of][i], { mean: Math.min(Math.max(mean, 0), 1), deviation: Math.min(Math.max(deviation, 0.02), 0.3) });
            ask();
        };
        dot.addEventListener("pointerdown", (event) => {
            dot.setPointerCapture(event.pointerId);
            event.preventDefault();
            dot.focus();
        });
        dot.addEventListener("pointermove", (event) => {
            if (!dot.hasPointerCapture(event.pointerId)) return;
            const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(densities.getScreenCTM().inverse());
            const density = ((height - at.y) / (height - 20)) * highest;
            move(at.x / width, density > 0 ? peak({ deviation: 1 }, share()) / density : 0.3);
        });
        dot.addEventListener("keydown", (event) => {
            const { mean, deviation } = setting[of][i];
            const [right, wider] = { ArrowLeft: [-0.01, 1], ArrowRight: [0.01, 1], ArrowUp: [0, 1 / 1.05], ArrowDown: [0, 1.05] }[event.key] ?? [];
            if (right === undefined) return;
            event.preventDefault();
            move(mean + right, deviation * wider);
        });
        densities.append(dot);
        return () => {
            const g = setting[of][i];
            dot.setAttribute("cx", to_x(g.mean));
            dot.setAttribute("cy", Math.max(to_y(peak(g, share())), 10));
            dot.setAttribute("aria-valuenow", g.mean.toFixed(3));
        };
    });
    const inputs = { share: "share", beta: "beta", count0: 0, count1: 1, count2: 2 };
    for (const [id, place] of Object.entries(inputs)) {
        const input = by_id(id), [object, key] = typeof place === "number" ? [setting.counts, place] : [setting, place];
        input.value = object[key];
        input.previousElementSibling.textContent = input.value;
        input.addEventListener("input", () => {
            object[key] = Number(input.value);
            input.previousElementSibling.textContent = input.value;
            ask();
        });
    }

    // At most once a frame.
    let is_asked = false;
    function ask() {
        if (is_asked) return;
        is_asked = true;
        requestAnimationFrame(() => {
            is_asked = false;
            update();
        });
    }
    let result;
    function update() {
        result = compute();
        if (rows.size === 0) Object.keys(result.variance).sort((a, b) => result.variance[b] - result.variance[a]).forEach(add_row);
        draw_densities(result);
        draw_variances(result);
        draw_weights(result);
        for (const place of dots) place();
        by_id("play").dataset.setting = JSON.stringify(setting);
    }
    by_id("heuristic").addEventListener("change", () => draw_weights(result));
    update();
});
