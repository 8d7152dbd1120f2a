"""The API reference: a page for each header, made of its docstrings and of its declarations as they stand.

A header is a comment that says what it is, then groups of a comment and the declarations below it, up to the
next empty line. Bodies of functions, private parts and namespaces `detail` are left out.
"""

import re


def _prose(comment):
    """The text of a // comment as Markdown: paragraphs, lists; what is indented stays as it is."""
    out, literal = [], []

    def end_literal():
        while literal and not literal[-1].strip():
            literal.pop()
        if literal:
            indent = min(len(l) - len(l.lstrip()) for l in literal if l.strip())
            out.extend(["", "```text"] + [l[indent:] for l in literal] + ["```", ""])
        literal.clear()

    is_list = False
    for line in comment:
        text = line.strip()[2:].rstrip()
        is_item = re.match(r" +- ", text) is not None
        if re.match(r" {3,}\S", text) and not is_item and not (is_list and re.match(r" {5}\S", text)):
            literal.append(text)
            is_list = False
            continue
        if literal and not text.strip():
            literal.append(text)
            continue
        end_literal()
        if is_list and not is_item and text.strip() and not re.match(r" {5}\S", text):
            out.append("")
        is_list = is_item or (is_list and bool(re.match(r" {5}\S", text)))
        if is_item and (not out or not out[-1].startswith("-")) and out and not out[-1].startswith("  "):
            out.append("")
        words = text.strip()
        if is_item:
            out.append("- " + _escaped(words[2:]))
        elif is_list:
            out.append("  " + _escaped(words))
        else:
            out.append(_escaped(words))
    end_literal()
    return "\n".join(out).strip()


def _escaped(text):
    parts = re.split(r"(`[^`]*`)", text)
    escaped = [p if p.startswith("`") else re.sub(r"([\\*_<>\[\]$~#|])", r"\\\1", p) for p in parts]
    return re.sub(r"docs/([a-z\\_]+)\.md", _link, "".join(escaped))


def _link(match):
    page = match[1].replace("\\", "")
    return f"[{page.replace('_', ' ')}](../{page}.md)"


def _without_bodies(code):
    """Declarations instead of definitions."""
    result, i, head = [], 0, 0
    while i < len(code):
        c = code[i]
        if c == "/" and code.startswith("//", i):
            end = code.find("\n", i)
            end = len(code) if end < 0 else end
            result.append(code[i:end])
            i = end
            continue
        if c == "{":
            before = re.sub(r"//[^\n]*", "", "".join(result[head:])).strip()
            is_type = re.match(r"(template\s*<.*?>\s*)*(struct|class|union|enum|namespace)\b", before, re.S)
            if not is_type and "(" in before and re.search(r"(\)|\bconst|\bnoexcept|>)$", before):
                i = _closing(code, i) + 1
                declared = "".join(result[head:]).rstrip()
                result[head:] = [re.sub(r"\)\s*:\s*[a-zA-Z_]\w*[({].*$", ")", declared, flags=re.S), ";"]
                head = len(result)
                if code.startswith(";", i):
                    i += 1
                continue
            if not is_type:  # an initializer
                end = _closing(code, i)
                text = code[i : end + 1]
                result.append(text if text.count("\n") < 8 else "{ ... }")
                i = end + 1
                continue
            result.append(c)
            head = len(result)
        else:
            result.append(c)
            if c in ";}" or (c == "\n" and "".join(result[head:]).strip().endswith(":")):
                head = len(result)
        i += 1
    return "".join(result)


def _closing(code, start):
    depth = 0
    for i in range(start, len(code)):
        depth += {"{": 1, "}": -1}.get(code[i], 0)
        if depth == 0:
            return i
    raise ValueError("a brace is not closed: " + code[start : start + 60])


def _name(code):
    """What a group of declarations is called in the page's contents."""
    code = re.sub(r"//[^\n]*", "", code)
    code = re.sub(r"\b(constexpr|inline|static|MIS_HOST_DEVICE)\b", "", code)
    while True:
        match = re.match(r"\s*template\s*<", code)
        if not match:
            break
        depth, i = 1, match.end()
        while depth:
            depth += {"<": 1, ">": -1}.get(code[i], 0)
            i += 1
        code = code[i:]
    match = re.match(r"\s*(?:struct|class|enum class|enum)\s+([\w:]+)", code) or re.match(
        r"\s*using\s+(\w+)", code
    )
    if match:
        return match[1]
    match = re.search(r"(operator\s*\S+?|\w+)\s*\(", code) or re.search(r"(\w+)\s*(?:=|\{|;)", code)
    return match[1] if match else None


def page(name, text):
    """The page of the header called name, as Markdown."""
    text = re.sub(r"namespace detail \{\n.*?\} // namespace detail\n", "", text, flags=re.S)
    lines = text.split("\n")
    at = next(i for i, line in enumerate(lines) if line.startswith("#pragma once"))
    about = [line for line in lines[:at] if line.startswith("//") and "SPDX" not in line]
    out = [f"# `{name}`", "", _prose(about), "", "```cpp", f"#include <{name}>", "```", ""]

    groups, comment, code, depth, continued = [], [], [], 0, False
    for line in lines[at + 1 :]:
        if continued or re.match(r"\s*#", line):
            continued = line.endswith("\\")
            continue
        if re.match(r"(inline )?namespace |\} // namespace", line):
            continue
        at_top = depth == 0
        if at_top and re.match(r"// ---- (.*) ----", line):
            groups.append((None, re.match(r"// ---- (.*) ----", line)[1]))
        elif at_top and (line.startswith("//") or not line.strip()):
            if code:
                groups.append((comment, code))
                comment, code = [], []
            if not line.strip():
                comment = []
            else:
                comment.append(line)
        else:
            code.append(line)
            bare = re.sub(r'//.*|"[^"]*"', "", line)
            depth += bare.count("{") - bare.count("}") + bare.count("(") - bare.count(")")
    if code:
        groups.append((comment, code))

    level = "##"
    for comment, code in groups:
        if comment is None:
            out += [f"## {code}", ""]
            level = "###"
            continue
        declared = re.sub(r"\n +private:.*?(?=\n\};)", "", "\n".join(code), flags=re.S)
        declared = re.sub(r"\n\s*\n", "\n", _without_bodies(declared)).strip()
        title = _name(declared)
        is_forward = re.sub(r"(template <[^;]*?> )?(struct|class) \w+;\s*", "", declared) == ""
        if not title or not declared or is_forward:
            continue
        out += [f"{level} `{title}`", "", _prose(comment), "", "```cpp", declared, "```", ""]
    return "\n".join(out) + "\n"


def floor(text):
    """"Floor N", as the header says in its second line, or None."""
    match = re.search(r"^// (Floor \d)", text, re.M)
    return match[1] if match else None


def summary(text):
    """What a header says of itself, in its first sentence without the floor."""
    about = []
    for line in text.split("\n"):
        if line.startswith("#pragma once") or (about and line.strip() == "//"):
            break
        if line.startswith("//") and "SPDX" not in line:
            about.append(line[2:].strip())
    sentence = re.match(r"Floor [^:]*: (.*?\.)(\s|$)", " ".join(about)) or re.match(
        r"(?:Floor [^:]*: )?(.*)", " ".join(about)
    )
    return _escaped(sentence[1])
