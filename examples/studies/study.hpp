// What all studies share: the command line, a table, progress, and checks that pass or fail.
#pragma once

#include <cmath>
#include <cstdarg>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <tools/files.hpp>
#include <tools/program.hpp>
#include <vector>

namespace studies {

// The options that all studies have, and those that studies with images have.
struct common_options {
    std::string output = "studies";
    std::uint64_t seed = 1;
    bool report_only = false;
};
struct image_options : common_options {
    int size = 64, threads = static_cast<int>(std::thread::hardware_concurrency());
};

// The command line of a study: what the study says of itself, the common options, and its own. CLI11 is long
// to compile: only study.cpp knows it.
class command_line {
public:
    command_line(const std::string& what, common_options& o);
    command_line(const std::string& what, image_options& o);
    ~command_line();

    // One number, or several, between a least and a greatest.
    void add(const std::string& name, int& value, const std::string& what, int least, int greatest);
    void add(const std::string& name, double& value, const std::string& what, double least, double greatest);
    void add(const std::string& name, std::vector<int>& values, const std::string& what, int least,
             int greatest);
    void add(const std::string& name, std::vector<double>& values, const std::string& what, double least,
             double greatest);
    void add_multiple(const std::string& name, int& value, const std::string& what, int of);
    // One word, or several; of `known` ones, unless that is empty.
    void add(const std::string& name, std::string& word, const std::string& what,
             const std::vector<std::string>& known);
    void add(const std::string& name, std::vector<std::string>& words, const std::string& what,
             const std::vector<std::string>& known);
    void add(const std::string& name, bool& flag, const std::string& what);

    // Parses it and does the work, as tools::run_program does; work tells whether all checks pass.
    int run(int count, char** arguments, const std::function<bool()>& work);

private:
    struct parser;
    std::unique_ptr<parser> all;
    const bool& report_only;
};

template <class Options, class Run>
int run_study(command_line& app, const Options& o, int count, char** arguments, Run&& run) {
    return app.run(count, arguments, [&] { return run(o); });
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
