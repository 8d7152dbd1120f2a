// What all studies share: the command line, a table, progress, and checks that pass or fail.
#pragma once

#include <cmath>
#include <cstdarg>
#include <cstdint>
#include <thread>
#include <tools/program.hpp>
#include <type_traits>
#include <vector>

namespace studies {

constexpr const char* exit_statuses = "Exit status: 0 all checks pass, 1 some do not, 2 bad input or output.";

// The options that all studies have, and those that studies with images have.
struct common_options {
    std::string output = "studies";
    std::uint64_t seed = 1;
    bool report_only = false;
};
struct image_options : common_options {
    int size = 64, threads = static_cast<int>(std::thread::hardware_concurrency());
};

// An option with a least and a greatest value.
template <class T>
void add_number(CLI::App& app, const std::string& name, T& value, const std::string& what,
                std::common_type_t<T> least, std::common_type_t<T> greatest) {
    app.add_option(name, value, what)
        ->check(CLI::Range(least, greatest) & tools::is_number)
        ->capture_default_str();
}
inline void add_common(CLI::App& app, common_options& o) {
    app.add_option("--output", o.output, "folder to write to")->capture_default_str();
    app.add_option("--seed", o.seed, "of all random numbers")->capture_default_str();
    app.add_flag("--report-only", o.report_only, "a missed bar is no failure: for runs too short to meet it");
}
inline void add_common(CLI::App& app, image_options& o) {
    add_common(app, static_cast<common_options&>(o));
    add_number(app, "--size", o.size, "width and height in pixels", 4, 1024);
    add_number(app, "--threads", o.threads, "that render", 1, 1024);
}

// The command line of a study: what the study says of itself, and the common options. Its own are added.
struct command_line : CLI::App {
    template <class Options>
    command_line(const std::string& what, Options& o) : CLI::App(what + "\n" + exit_statuses) {
        add_common(*this, o);
    }
};

// Parses it and runs the study, as tools::run_program does; run(options) tells whether all checks pass.
template <class Options, class Run>
int run_study(command_line& app, const Options& o, int count, char** arguments, Run&& run) {
    return tools::run_program(app, count, arguments, [&] { return run(o) || o.report_only ? 0 : 1; });
}

// A CSV file in a folder that is made where it is missing. Lines are written as they come, so that nothing
// computed is lost.
class csv_file {
public:
    csv_file(const std::string& folder, const std::string& name, const std::string& heading)
        : file(in_folder(folder, name)) {
        add(heading);
    }
    void add(const std::string& line) {
        file.add(line);
        file.finish();
    }

private:
    static std::string in_folder(const std::string& folder, const std::string& name) {
        std::error_code failure; // shows where the file is opened
        std::filesystem::create_directories(folder, failure);
        return folder + "/" + name;
    }

    tools::line_file file;
};

// printf into a string.
[[gnu::format(printf, 1, 2)]] inline std::string text(const char* format, ...) {
    char buffer[512];
    va_list arguments;
    va_start(arguments, format);
    std::vsnprintf(buffer, sizeof buffer, format, arguments);
    va_end(arguments);
    return buffer;
}

// Slope of the line through the logarithms of some points, by least squares.
template <class X, class Y> double log_log_slope(const std::vector<X>& x, const std::vector<Y>& y) {
    double x_sum = 0, y_sum = 0, xx = 0, xy = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        const double a = std::log(static_cast<double>(x[i])), b = std::log(static_cast<double>(y[i]));
        x_sum += a, y_sum += b, xx += a * a, xy += a * b;
    }
    const double count = static_cast<double>(x.size());
    return (count * xy - x_sum * y_sum) / (count * xx - x_sum * x_sum);
}

using tools::show_progress;

// Prints a check and returns whether it is good.
inline bool report(bool good, const std::string& what) {
    show_progress("");
    std::printf("  %-4s  %s\n", good ? "pass" : "FAIL", what.c_str());
    return good;
}
// Prints what is worth knowing, but no check.
inline void note(const std::string& what) {
    show_progress("");
    std::printf("  note  %s\n", what.c_str());
}

} // namespace studies
