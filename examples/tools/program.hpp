// What programs have in common: progress, and an end in order where they are interrupted.
#pragma once

#include "files.hpp"
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <unistd.h>

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
