// No C++ in README.md or docs/ that is not compiled somewhere: each block, paragraph by paragraph, is a
// verbatim part (but for white space) of the file that the line before it names, <!-- from FILE -->, or else
// of docs_snippets.cpp.
#include <algorithm>
#include <doctest/doctest.h>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace {

const std::string root = MIS_ROOT;

std::string text_of(const std::string& file) {
    std::ifstream in(root + "/" + file);
    std::stringstream all;
    all << in.rdbuf();
    return all.str();
}

std::string without_space(std::string text) {
    text.erase(std::remove_if(text.begin(), text.end(), [](unsigned char c) { return c <= ' '; }),
               text.end());
    return text;
}

struct paragraph {
    std::string text, source; // the file that it is to be a part of
    int line;
};

std::vector<paragraph> paragraphs_of(const std::string& page) {
    std::istringstream lines(text_of(page));
    std::vector<paragraph> all;
    std::string source;
    bool in_block = false, starts = false;
    int number = 0;
    for (std::string line; std::getline(lines, line);) {
        ++number;
        const auto first = line.find_first_not_of(' ');
        const std::string trimmed = first == std::string::npos ? "" : line.substr(first);
        const std::string from = "<!-- from ";
        if (trimmed.rfind("```", 0) == 0) {
            const bool is_cpp = trimmed.rfind("```cpp", 0) == 0 || trimmed.rfind("```c++", 0) == 0;
            if (in_block)
                source.clear();
            in_block = !in_block && is_cpp;
            starts = true;
        } else if (!in_block) {
            if (trimmed.rfind(from, 0) == 0)
                source = trimmed.substr(from.size(), trimmed.find(' ', from.size()) - from.size());
        } else if (trimmed.empty()) {
            starts = true;
        } else {
            if (starts)
                all.push_back({"", source.empty() ? "tests/docs_snippets.cpp" : source, number});
            starts = false;
            all.back().text += line + "\n";
        }
    }
    return all;
}

} // namespace

TEST_CASE("every C++ block is a part of a file that is compiled") {
    std::vector<std::string> pages{"README.md", "CONTRIBUTING.md"};
    for (const auto& entry : std::filesystem::directory_iterator(root + "/docs"))
        if (entry.path().extension() == ".md")
            pages.push_back("docs/" + entry.path().filename().string());
    int checked = 0;
    for (const auto& page : pages)
        for (const paragraph& p : paragraphs_of(page)) {
            const std::string source = without_space(text_of(p.source));
            REQUIRE_MESSAGE(!source.empty(), page, ":", p.line, ": no file ", p.source);
            CHECK_MESSAGE(source.find(without_space(p.text)) != std::string::npos, page, ":", p.line,
                          ": not a part of ", p.source, ":\n", p.text);
            ++checked;
        }
    CHECK(checked > 50);
}
