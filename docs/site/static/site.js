// Formulas, and pictures that enlarge. No request leaves the folder.
document.addEventListener("DOMContentLoaded", () => {
    for (const formula of document.querySelectorAll(".math")) {
        const source = formula.textContent.trim();
        katex.render(source.replace(/^\\[([]/, "").replace(/\\[)\]]$/, ""), formula, {
            displayMode: source.startsWith("\\["),
            throwOnError: true,
        });
    }

    // What the theme leaves out for readers without a mouse, or with a screen reader.
    for (const caption of document.querySelectorAll(".caption[role=heading]")) caption.ariaLevel = 2;
    for (const wide of document.querySelectorAll("pre, .table-wrapper, div.math")) wide.tabIndex = 0;

    const dialog = document.createElement("dialog");
    dialog.className = "enlarged";
    dialog.setAttribute("aria-label", "Picture, enlarged");
    const shown = document.createElement("img");
    const close = document.createElement("button");
    close.textContent = "Close";
    dialog.append(close, shown);
    document.body.append(dialog);
    dialog.addEventListener("click", () => dialog.close());

    for (const picture of document.querySelectorAll("article img")) {
        if (picture.closest("button, a")) continue;
        const button = document.createElement("button");
        button.className = "enlarges";
        button.setAttribute("aria-label", `Enlarge: ${picture.alt}`);
        picture.replaceWith(button);
        button.append(picture);
        button.addEventListener("click", () => {
            shown.src = picture.src;
            shown.alt = picture.alt;
            dialog.showModal();
        });
    }
});
