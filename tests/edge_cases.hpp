// The tables of docs/edge_cases.md: what each entry point does with 0, infinity, NaN, a negative number, a
// subnormal one and nothing at all. Here each cell is its text and a check of it; the document must have the
// same texts. Compiled with assertions, whatever the build.
#pragma once

#include <csignal>
#include <doctest/doctest.h>
#include <fcntl.h>
#include <fstream>
#include <functional>
#include <limits>
#include <string>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

namespace edge_cases {

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();
constexpr float subnormal = std::numeric_limits<float>::denorm_min();

// Whether an assertion stops the program in f, which runs in a process of its own.
template <class F> bool asserts(F&& f) {
    const pid_t child = fork();
    if (child == 0) {
        std::signal(SIGABRT, SIG_DFL);
        const int nowhere = open("/dev/null", O_WRONLY);
        dup2(nowhere, STDERR_FILENO);
        f();
        _exit(0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    return child > 0 && WIFSIGNALED(status) && WTERMSIG(status) == SIGABRT;
}

// Keeps a result that nobody looks at from being optimized away, and with it what is asserted on the way.
template <class T> void use(const T& result) { asm volatile("" : : "g"(&result) : "memory"); }

struct cell {
    std::string text;
    std::function<bool()> holds;
};

// There is no such input: a negative count of a type without negative numbers, an empty pair.
inline cell none() {
    return {"–", [] { return true; }};
}

// An assertion stops the program where they are on; elsewhere the result is unspecified.
template <class F> cell asserted(F f) {
    return {"asserted", [f] { return asserts([f] { use(f()); }); }};
}

struct row {
    std::string call; // as the document has it
    cell zero, infinite, nan, negative, subnormal, empty;
};

inline std::vector<std::string> lines_of_section(const std::string& section) {
    std::ifstream document(MIS_ROOT "/docs/edge_cases.md");
    std::vector<std::string> lines;
    bool inside = false;
    for (std::string line; std::getline(document, line);) {
        if (line.rfind("## ", 0) == 0)
            inside = line == "## " + section;
        else if (inside && line.rfind("| `", 0) == 0)
            lines.push_back(line);
    }
    return lines;
}

// The section has these rows, in this order, and no others; and what they say is true.
inline void check(const std::string& section, const std::vector<row>& rows) {
    const std::vector<std::string> lines = lines_of_section(section);
    CHECK(lines.size() == rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const row& r = rows[i];
        std::string line = "| `" + r.call + "` |";
        for (const cell* c : {&r.zero, &r.infinite, &r.nan, &r.negative, &r.subnormal, &r.empty}) {
            INFO(r.call, ": ", c->text);
            CHECK(c->holds());
            line += " " + c->text + " |";
        }
        CHECK(line == (i < lines.size() ? lines[i] : "(no such row)"));
    }
}

} // namespace edge_cases
