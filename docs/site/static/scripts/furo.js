// In place of the theme's own script, a module, which browsers do not load from files: light, dark, or as the
// system has it, kept from page to page.
document.documentElement.classList.remove("no-js");
for (const button of document.querySelectorAll(".theme-toggle")) {
    button.addEventListener("click", () => {
        const next = { auto: "light", light: "dark", dark: "auto" };
        const theme = next[document.body.dataset.theme] ?? "auto";
        document.body.dataset.theme = theme;
        localStorage.setItem("theme", theme);
    });
}
