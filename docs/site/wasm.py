"""Programs for pages, from the same sources as the native ones, by Debian's Emscripten."""

import json
import os
import pathlib
import platform
import shutil
import subprocess
import sys
import tarfile

here = pathlib.Path(__file__).resolve().parent
root = here.parent.parent
flags = ["-O3", "-msimd128", "-fwasm-exceptions", "-Wno-#pragma-messages"]
# Debian's node finds Debian's modules by itself, others that are installed in its place do not.
environment = {**os.environ, "NODE_PATH": "/usr/share/nodejs"}


def fail(message):
    sys.exit(f"build.py: {message}")


def run(command, **options):
    done = subprocess.run([str(word) for word in command], text=True, check=False, **options)
    if done.returncode:
        fail(f"{command[0]} failed with status {done.returncode}: {' '.join(map(str, command))}")
    return done.stdout


def debian_sources(packages, folder):
    """Unpacks sources of Debian packages into folder/PACKAGE: libraries of Debian are for this machine only. Takes
    the versions that this Debian was released with, whether or not its sources are among what apt usually reads."""
    missing = [package for package in packages if not (folder / package).exists()]
    if not missing:
        return
    folder.mkdir(parents=True, exist_ok=True)
    listed = run(["apt-get", "indextargets", "--format", "$(CREATED_BY) $(COMPONENT) $(REPO_URI) $(CODENAME)"],
                 stdout=subprocess.PIPE)
    key = "/usr/share/keyrings/debian-archive-keyring.gpg"
    by = f"[signed-by={key}] " if os.path.exists(key) else ""
    release = platform.freedesktop_os_release()["VERSION_CODENAME"]
    lines = set()
    for made_by, component, uri, codename in [line.split() for line in listed.splitlines()]:
        if made_by == "Packages" and component == "main" and codename == release:
            lines.add(f"deb-src {by}{uri} {codename} {component}\n")
    if not lines:
        fail("apt-get knows no Debian archive: run apt-get update")
    (folder / "sources.list").write_text("".join(sorted(lines)))
    (folder / "lists" / "partial").mkdir(parents=True, exist_ok=True)
    apt = ["apt-get", "-q", "-o", f"Dir::Etc::SourceList={folder}/sources.list", "-o", "Dir::Etc::SourceParts=/dev/null",
           "-o", f"Dir::State::Lists={folder}/lists", "-o", "APT::Sandbox::User="]
    run([*apt, "update"], stdout=subprocess.DEVNULL)
    run([*apt, "source", "--download-only", *missing], cwd=folder, stdout=subprocess.DEVNULL)
    shutil.rmtree(folder / "lists")
    for package in missing:
        [archive] = folder.glob(f"{package}_*.orig.tar.*")
        unpacked = folder / f"{package}.part"
        with tarfile.open(archive) as tar:
            tar.extractall(unpacked)
        [top] = unpacked.iterdir()
        top.rename(folder / package)
        unpacked.rmdir()


def compile_and_link(name, sources, includes, output, link):
    """One script of glue and program, without files to fetch; not made again where no source is newer."""
    compiled = []
    folder = output.parent / name
    folder.mkdir(parents=True, exist_ok=True)
    running = []
    for source in sources:
        made = folder / (source.stem + ".o")
        is_c = source.suffix == ".c"
        own = ["-Wall", "-Wextra", "-Werror"] if folder.parent not in source.parents else []
        command = ["emcc" if is_c else "em++", *flags, *own, *([] if is_c else ["-std=c++17"]), *includes, "-MMD", "-c", source,
                   "-o", made]
        compiled.append(made)
        if is_up_to_date(made):
            continue
        while len(running) >= 2:
            finish(running.pop(0))
        running.append((command, subprocess.Popen([str(word) for word in command], env=environment)))
    for one in running:
        finish(one)
    run(["em++", *flags, *compiled, "-o", output, "-sSINGLE_FILE", "-sMODULARIZE", f"-sEXPORT_NAME={name}",
         *link], env=environment)


def finish(running):
    command, process = running
    if process.wait():
        fail(f"{command[0]} failed: {' '.join(map(str, command))}")


def is_up_to_date(made):
    """By the list of files that the compiler has read, and this one."""
    listed = made.with_suffix(".d")
    if not made.exists() or not listed.exists():
        return False
    read = listed.read_text().replace("\\\n", " ").split(":", 1)[1].split()
    read.append(__file__)
    return all(pathlib.Path(name).exists() and pathlib.Path(name).stat().st_mtime <= made.stat().st_mtime
               for name in read)


def headers_of_debian(folder, linked):
    """A folder with some of the headers that Debian packages: all of /usr/include is not for WebAssembly."""
    folder.mkdir(exist_ok=True)
    for target in map(pathlib.Path, linked):
        if not target.exists():
            fail(f"there is no {target}")
        link = folder / target.name
        link.unlink(missing_ok=True)
        link.symlink_to(target)
    return ["-isystem", folder]


def build_check(folder):
    """check_program.js: the text of a worker, as a string."""
    sources = folder / "debian"
    debian_sources(["simdjson", "zlib"], sources)
    simdjson, zlib = sources / "simdjson" / "singleheader", sources / "zlib"
    checker = root / "examples" / "check_paths"
    used = [simdjson / "simdjson.cpp", here / "wasm" / "check.cpp", checker / "reader.cpp", checker / "geometry.cpp",
            checker / "lines.cpp", checker / "report.cpp"]
    used += [zlib / f"{part}.c" for part in ["inflate", "inffast", "inftrees", "adler32", "crc32", "zutil"]]
    includes = headers_of_debian(folder / "check_headers", ["/usr/include/nlohmann", simdjson / "simdjson.h"])
    includes += ["-isystem", zlib, "-I", root / "include", "-I", checker]
    # By itself simdjson has only plain code for a processor that it does not know.
    includes += ["-msse4.2", "-DSIMDJSON_IMPLEMENTATION_WESTMERE=1", "-DSIMDJSON_BUILTIN_IMPLEMENTATION=westmere",
                 "-DSIMDJSON_IMPLEMENTATION_FALLBACK=0", "-I", here / "wasm"]
    made = folder / "check_paths.js"
    compile_and_link("check_paths", used, includes, made, [
        "-sENVIRONMENT=worker", "-sALLOW_MEMORY_GROWTH", "-sMAXIMUM_MEMORY=2GB", "-sFORCE_FILESYSTEM",
        "-sEXPORTED_RUNTIME_METHODS=FS,ccall",
        # Functions as they were written: browsers take long to optimize large ones.
        "-sBINARYEN_EXTRA_PASSES=--one-caller-inline-max-function-size=1"])
    worker = made.read_text() + (here / "wasm" / "check_worker.js").read_text()
    return "const check_program = " + json.dumps(worker) + ";\n"


def build_play(folder, name):
    """NAME_program.js: a function that loads the program."""
    pcg = [f"/usr/include/pcg_{part}.hpp" for part in ["random", "extras", "uint128"]]
    includes = headers_of_debian(
        folder / "play_headers", ["/usr/include/nlohmann", "/usr/include/eigen3/Eigen", "/usr/include/glm", *pcg])
    includes += ["-I", root / "include", "-I", root / "examples"]
    made = folder / f"{name}.js"
    compile_and_link(name, [here / "wasm" / f"{name}.cpp"], includes, made,
                     ["-sENVIRONMENT=web", "-sALLOW_MEMORY_GROWTH", "-sEXPORTED_RUNTIME_METHODS=ccall"])
    return made.read_text()


def build(folder, static):
    """Puts the programs into `static`; what they are made of is kept in `folder`."""
    for needed, package in [("em++", "emscripten"), ("apt-get", "Debian")]:
        if not shutil.which(needed):
            fail(f"there is no {needed}: install {package}")
    folder.mkdir(parents=True, exist_ok=True)
    (static / "check_program.js").write_text(build_check(folder))
    for name in ["play", "play_plates"]:
        (static / f"{name}_program.js").write_text(build_play(folder, name))
