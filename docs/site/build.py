#!/usr/bin/python3
"""Builds the site: build.py FOLDER. The pages are README.md and docs/*.md, and a reference page for each header;
needs Sphinx, MyST, furo and KaTeX, and Emscripten for the pages that compute. Any warning, such as one of a broken link, is an error."""

import pathlib
import re
import shutil
import subprocess
import sys

import reference
import wasm

import furo

here = pathlib.Path(__file__).resolve().parent
root = here.parent.parent
katex = pathlib.Path("/usr/share/javascript/katex")
normalize = pathlib.Path("/usr/share/javascript/normalize.css/normalize.css")

# What the pages are in the menu, by what a reader is after.
menu = {
    "In a renderer": ["path_tracer", "bidirectional", "merging", "media", "roulette", "edge_cases"],
    "Into a renderer that has weights": [
        "migrate", "migrate_three_numbers", "migrate_pbrt", "migrate_path_tracers", "migrate_hard_cases", "end_points"],
    "When the image is wrong": ["wrong_weights", "check", "path_dump", "unit_tests"],
    "Which heuristic, how many samples": [
        "play", "play_plates", "direct_lighting", "heuristics", "multipliers", "optimal", "allocation", "sequences", "bias"],
    "How it works": ["recursion", "performance", "many_machines"],
}
not_public = ["config"]


def stylesheet():
    """furo's, as Debian packages it, with what a page needs that is read from a file: the sheet that it imports from
    a server, and dark colours where the reader's system is dark, which are lost there."""
    text = (pathlib.Path(furo.__file__).parent / "theme/furo/static/styles/furo.css").read_text()
    text = re.sub(r"@import url\([^)]*\);", "", text)
    dark = re.search(r'body\[data-theme="dark"\] (\{.*?\})', text, re.S)
    if not dark:
        fail("furo.css has no dark colours")
    auto = f'@media (prefers-color-scheme: dark) {{ body[data-theme="auto"] {dark[1]} }}'
    return "\n".join([normalize.read_text(), text, auto])


def toctree(caption, pages):
    return "\n".join(["", "```{toctree}", ":hidden:", f":caption: {caption}", "", *pages, "```", ""])


def fail(message):
    sys.exit(f"build.py: {message}")


def reference_name(header):
    return "reference/" + header.replace("/", "_")


def stage(source):
    """Everything that Sphinx reads."""
    shutil.rmtree(source, ignore_errors=True)
    (source / "reference").mkdir(parents=True)
    shutil.copy(here / "conf.py", source)
    shutil.copytree(here / "static", source / "static")
    fonts = source / "static" / "katex" / "fonts"
    fonts.mkdir(parents=True)
    for file in ["katex.min.js", "katex.min.css"]:
        shutil.copy(katex / file, fonts.parent)
    for font in (katex / "fonts").glob("*.woff2"):
        shutil.copy(font, fonts)
    (source / "static" / "styles").mkdir()
    (source / "static" / "styles" / "furo.css").write_text(stylesheet())
    shutil.copytree(root / "docs" / "images", source / "images")

    pages = {page.stem: page for folder in [root / "docs", here / "pages"] for page in folder.glob("*.md")}
    listed = [name for names in menu.values() for name in names]
    if sorted(listed) != sorted(pages):
        fail(f"the menu and docs/ differ in {sorted(set(listed) ^ set(pages))}")
    for page in pages.values():
        shutil.copy(page, source)

    headers = {str(h.relative_to(root / "include" / "mis").with_suffix("")): h
               for h in (root / "include" / "mis").rglob("*.hpp")}
    headers = {name: header.read_text() for name, header in headers.items() if name not in not_public}
    floors = {"Floors 0 to 3": ["mis"]}
    for name in sorted(headers, key=lambda name: (reference.floor(headers[name]) or "", name)):
        floor = reference.floor(headers[name])
        if floor:
            floors.setdefault(floor, []).append(name)
        elif name != "mis":
            fail(f"mis/{name}.hpp does not say on which floor it stands")
        (source / f"{reference_name(name)}.md").write_text(reference.page(f"mis/{name}.hpp", headers[name]))

    index = (root / "README.md").read_text()
    index = index.replace("](docs/", "](")
    linked = lambda m: f"[`{m[1]}.hpp`]({reference_name(m[1])}.md)" if m[1] in headers else m[0]
    index = re.sub(r"`([a-z_/]+)\.hpp`", linked, index)
    for caption, names in menu.items():
        index += toctree(caption, names)
    index += toctree("Reference", ["reference/index"])
    (source / "index.md").write_text(index)

    overview = ["# Reference", "", "Each header includes only what is on its floor or below.", ""]
    for floor, names in floors.items():
        overview += [f"## {floor}", ""]
        for name in names:
            first = reference.summary(headers[name])
            overview.append(f"- [`mis/{name}.hpp`]({name.replace('/', '_')}.md): {first}")
        overview.append("")
    all_pages = [name.replace("/", "_") for names in floors.values() for name in names]
    (source / "reference" / "index.md").write_text("\n".join(overview) + toctree("Headers", all_pages))


def main():
    if len(sys.argv) != 2:
        sys.exit("usage: build.py FOLDER")
    site = pathlib.Path(sys.argv[1])
    source = site.parent / (site.name + "_source")
    for needed, package in [(katex, "libjs-katex"), (normalize, "node-normalize.css")]:
        if not needed.exists():
            fail(f"there is no {needed}: install {package}")
    stage(source)
    wasm.build(site.resolve().parent / (site.name + "_programs"), source / "static")
    shutil.rmtree(site, ignore_errors=True)
    done = subprocess.run(
        [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-n", "-b", "html", "-j", "2",
         "-d", str(source / "doctrees"), str(source), str(site)], check=False)
    if done.returncode:
        sys.exit(done.returncode)
    shutil.rmtree(site / ".doctrees", ignore_errors=True)
    print(f"The site: {site.resolve() / 'index.html'}")


main()
