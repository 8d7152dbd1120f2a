// What programs have in common: a command line, one line for what goes wrong, and an end in order where they
// are interrupted.
#pragma once

#include "files.hpp"
#include <CLI/CLI.hpp>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <iostream>

namespace tools {

// Set by SIGINT (Control-C) and SIGTERM where a program finishes what is at hand and writes what there is.
// SIGQUIT ends it at once.
inline volatile std::sig_atomic_t interrupted = 0;
inline void finish_when_interrupted() {
    for (const int signal : {SIGINT, SIGTERM})
        std::signal(signal, [](int) { interrupted = 1; });
}

// Says in one line, on standard error, that an image has not all passes.
inline void report_interruption(const std::string& image, int passes, int all) {
    std::fprintf(stderr, "interrupted: %s: %s%d of %d passes\n", image.c_str(),
                 passes > 0 ? "the image has " : "no image, ", passes, all);
}

// Parses the command line and does the work; what goes wrong, standard output that cannot be written
// included, is one line on standard error. Returns the exit status: 2 where something went wrong, 130 after
// an interruption, else run()'s.
template <class Run> int run_program(CLI::App& app, int count, char** arguments, Run&& run) {
    try {
        int status = 0;
        try {
            app.parse(count, arguments);
            status = run();
        } catch (const CLI::CallForHelp& help) {
            status = app.exit(help);
            std::cout.flush();
        }
        finish_standard_output();
        return interrupted ? 130 : status;
    } catch (const std::exception& error) {
        const std::string program = std::filesystem::path(arguments[0]).filename();
        std::fprintf(stderr, "%s: %s\n", program.c_str(), error.what());
        return 2;
    }
}

// CLI::Range lets NaN pass.
inline const CLI::Validator is_number(
    [](std::string& text) {
        double x = 0;
        const bool is_nan = CLI::detail::lexical_cast(text, x) && std::isnan(x);
        return is_nan ? "Value " + text + " is not a number" : std::string();
    },
    "");

// Makes a folder. Throws std::runtime_error where it cannot.
inline void make_folder(const std::string& name) {
    std::error_code failure;
    std::filesystem::create_directories(name, failure);
    if (failure)
        throw std::runtime_error("--output '" + name + "' is no folder that can be written to");
}

// One line on a terminal, that the next one overwrites; empty: no line.
inline void show_progress(const std::string& line) {
    if (isatty(STDERR_FILENO))
        std::fprintf(stderr, "\r\033[K%s", line.c_str());
}

} // namespace tools
