// Reads a renderer's weighted paths and reports whether their weights are right.
#include "report.hpp"
#include <chrono>
#include <tools/command_line.hpp>

namespace {

struct options {
    std::string file;
    double tolerance = 1e-4;
    std::size_t examples = 2;
    std::int64_t most_malformed = check_paths::default_most_malformed;
    bool json = false;
};

[[noreturn]] void fail(const std::string& message) { throw std::runtime_error(message); }

// On a terminal, a line that is overwritten a few times a second.
struct progress {
    using clock = std::chrono::steady_clock;
    bool is_shown = isatty(STDERR_FILENO) != 0;
    clock::time_point start = clock::now(), next = start;
};

void show_progress(progress& p, const check_paths::line_reader& lines) {
    using namespace std::chrono;
    constexpr int lines_between_looks = 256; // at the clock
    if (!p.is_shown || lines.line % lines_between_looks != 0)
        return;
    const auto now = progress::clock::now();
    if (now < p.next)
        return;
    p.next = now + milliseconds(200);
    const double read = static_cast<double>(lines.bytes_read) / 1e6;
    const double seconds = duration<double>(now - p.start).count();
    std::fprintf(stderr, "\r\033[K%.1f", read);
    if (lines.file_size > 0)
        std::fprintf(stderr, " of %.1f", static_cast<double>(lines.file_size) / 1e6);
    std::fprintf(stderr, " MB, %lld lines", static_cast<long long>(lines.line));
    if (seconds > 0)
        std::fprintf(stderr, ", %.0f per second", static_cast<double>(lines.line) / seconds);
}

void clear_progress(const progress& p) {
    if (p.is_shown)
        std::fprintf(stderr, "\r\033[K");
}

check_paths::report check(check_paths::path_reader& reader, const options& o) {
    check_paths::report report;
    report.diagnosis.tolerance = o.tolerance;
    progress shown;
    do
        check_paths::add_all(report, reader, o.most_malformed, [&] { show_progress(shown, reader.lines); });
    while (check_paths::wait_for_more(reader.lines));
    clear_progress(shown);
    return report;
}

int run(const options& o) {
    check_paths::path_reader reader;
    if (!check_paths::open_lines(reader.lines, o.file))
        fail("'" + o.file + "' cannot be read: " + reader.lines.failure);
    const check_paths::report report = check(reader, o);
    const mis::finding found = check_paths::suspects_in(report, o.examples);
    if (o.json)
        std::printf("%s\n", check_paths::to_json(report, found).dump(2).c_str());
    else
        check_paths::print(report, found, stdout);
    tools::finish_standard_output();
    if (const std::string why = check_paths::complaint(report, o.file); !why.empty())
        fail(why);
    return check_paths::exit_status(report, found);
}

} // namespace

int main(int count, char** arguments) {
    CLI::App app{
        "Checks the weights of a renderer's paths, written down as docs/path_dump.md describes.\n"
        "Exit status: 0 all agree, 1 some do not, 2 not all of the input could be read, or the report not "
        "written.\nLines of more than 16 MiB or 1000 vertices are no records."};
    options o;
    app.add_option("FILE", o.file, "path dump, JSON Lines, also compressed with gzip; - is standard input")
        ->required();
    app.add_option("--tolerance", o.tolerance, "largest relative error of a weight that agrees")
        ->capture_default_str();
    app.add_option("--examples", o.examples, "records to show for each suspect")
        ->check(CLI::NonNegativeNumber)
        ->capture_default_str();
    app.add_option("--most-malformed", o.most_malformed, "give up after more lines that are no records")
        ->check(CLI::NonNegativeNumber)
        ->capture_default_str();
    app.add_flag("--json", o.json, "print the report as JSON");
    return tools::run_program(app, count, arguments, [&] {
        if (!(o.tolerance >= 0 && o.tolerance < 1))
            fail("--tolerance must be at least 0 and below 1");
        return run(o);
    });
}
