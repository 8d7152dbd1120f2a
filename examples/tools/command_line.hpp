// A program's command line, and one line for what goes wrong.
#pragma once

#include "files.hpp"
#include "program.hpp"
#include <CLI/CLI.hpp>
#include <cmath>
#include <iostream>

namespace tools {

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
inline CLI::Validator is_number() {
    const auto complaint = [](std::string& text) {
        double x = 0;
        const bool is_nan = CLI::detail::lexical_cast(text, x) && std::isnan(x);
        return is_nan ? "Value " + text + " is not a number" : std::string();
    };
    return {complaint, ""};
}

} // namespace tools
