// Speed and memory of check_paths: the peak memory after more and more records through a pipe, and records
// per second of CPU time, of a right dump and of one in which a mistake makes most weights wrong. It should
// judge at least 50,000 records per second, and from 100,000 records on its memory should hardly grow;
// before, the samples fill up in which suspects are searched.
#include <benchmark/benchmark.h>
#include <cstdio>
#include <cstdlib>
#include <lab/render.hpp>
#include <report.hpp>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace {

// A dump in memory, and how many records it has.
struct dump {
    std::string lines;
    std::int64_t records = 0;
};

[[noreturn]] void fail(const char* what) {
    std::perror(what);
    std::exit(1);
}

// Paths of a scene with all kinds of vertices and lights, made by all techniques: at most 10,000.
dump rendered(const lab::mistake_set& mistakes) {
    constexpr int width = 48, records = 10'000;
    const auto scene = lab::scaled(lab::make_scene<double>("mixed"), 0.01);
    lab::settings<double> s;
    s.width = width;
    s.passes = 1;
    s.check_weights = false;
    s.dump_paths = records / width;
    s.heuristic = {lab::heuristic_kind::power, 2};
    s.merge_radius = 0.01 * scene.radius;
    s.counts = mis::connection_and_merging<double>(width * width, s.merge_radius);
    s.counts.next_event = 2;
    s.mistakes = mistakes;
    dump d;
    lab::render(scene, s, [&](const lab::pass_result<double>& result) {
        for (const auto& row : result.rows)
            for (const auto& line : row.dump)
                d.lines += line + '\n', ++d.records;
    });
    return d;
}

const dump& right_dump() {
    static const dump d = rendered({});
    return d;
}
const dump& wrong_dump() {
    static const dump d = [] {
        lab::mistake_set set;
        set.planted.set(static_cast<std::size_t>(lab::mistake::solid_angle_as_area));
        return rendered(set);
    }();
    return d;
}

// A file that holds the dump, gone once it is closed.
std::FILE* file_of(const dump& d) {
    std::FILE* const file = std::tmpfile();
    if (!file || std::fwrite(d.lines.data(), 1, d.lines.size(), file) != d.lines.size() ||
        std::fflush(file) != 0)
        fail("temporary file");
    return file;
}

// Another descriptor of a file, at its start.
int from_start(std::FILE* file) {
    const int descriptor = dup(fileno(file));
    if (descriptor < 0 || lseek(descriptor, 0, SEEK_SET) != 0)
        fail("temporary file");
    return descriptor;
}

check_paths::report checked(int descriptor) {
    check_paths::path_reader reader;
    if (!check_paths::open_lines(reader.lines, descriptor))
        fail("dump");
    check_paths::report report;
    while (check_paths::add_next(report, reader)) {
    }
    return report;
}

// ---- Time ----

// Counted by the processor time of this thread, which other programs do not lengthen.
void count_records(benchmark::State& state, std::int64_t records) {
    state.counters["records"] = static_cast<double>(records);
    state.counters["records_per_second"] =
        benchmark::Counter(static_cast<double>(state.iterations() * records), benchmark::Counter::kIsRate);
}

void read_only(benchmark::State& state, const dump& (*made)()) {
    const dump& d = made();
    std::FILE* const file = file_of(d);
    std::int64_t records = 0;
    for (auto _ : state) {
        check_paths::path_reader reader;
        if (!check_paths::open_lines(reader.lines, from_start(file)))
            fail("dump");
        mis::path_record record;
        std::string error;
        records = 0;
        while (check_paths::next_record(reader, record, error) == check_paths::read_status::record)
            ++records;
    }
    std::fclose(file);
    count_records(state, records);
}
void read_and_judge(benchmark::State& state, const dump& (*made)()) {
    const dump& d = made();
    std::FILE* const file = file_of(d);
    check_paths::tally all;
    for (auto _ : state)
        all = checked(from_start(file)).all;
    std::fclose(file);
    count_records(state, all.records);
    state.counters["wrong"] = static_cast<double>(all.disagreeing);
}
void search_suspects(benchmark::State& state, const dump& (*made)()) {
    std::FILE* const file = file_of(made());
    const check_paths::report report = checked(from_start(file));
    std::fclose(file);
    std::size_t suspects = 0;
    for (auto _ : state)
        suspects = check_paths::suspects_in(report, 2).suspects.size();
    state.counters["suspects"] = static_cast<double>(suspects);
}
BENCHMARK_CAPTURE(read_only, right, right_dump)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(read_and_judge, right, right_dump)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(read_and_judge, wrong, wrong_dump)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(search_suspects, wrong, wrong_dump)->Unit(benchmark::kMillisecond);

// ---- Memory ----

// Of this process, so far.
double peak_mebibytes() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return static_cast<double>(usage.ru_maxrss) / 1024; // Linux counts in KiB
}

// Writes so many of a dump's lines, over and over.
void write_lines(int descriptor, const dump& d, std::int64_t count) {
    for (std::size_t at = 0; count > 0; --count) {
        const std::size_t end = d.lines.find('\n', at) + 1;
        while (at < end) {
            const ssize_t written = write(descriptor, d.lines.data() + at, end - at);
            if (written < 0)
                fail("pipe");
            at += static_cast<std::size_t>(written);
        }
        at = end == d.lines.size() ? 0 : end;
    }
}

// The reading end of a pipe into which another process renders: its memory is not that of the check.
int rendered_elsewhere(std::int64_t count) {
    int ends[2];
    if (pipe(ends) != 0)
        fail("pipe");
    const pid_t child = fork();
    if (child < 0)
        fail("fork");
    if (child == 0) {
        close(ends[0]);
        write_lines(ends[1], wrong_dump(), count);
        _exit(0);
    }
    close(ends[1]);
    return ends[0];
}

// To be called before this process has used memory for anything else.
void print_memory() {
    std::printf("%-28s %9.1f MiB\n", "peak memory before", peak_mebibytes());
    for (const std::int64_t count : {1'000, 100'000, 1'000'000}) {
        const check_paths::report report = checked(rendered_elsewhere(count));
        wait(nullptr);
        std::printf("after %9lld records      %9.1f MiB\n", static_cast<long long>(report.all.records),
                    peak_mebibytes());
        std::fflush(stdout);
    }
}

} // namespace

int main(int count, char** arguments) {
    benchmark::Initialize(&count, arguments);
    if (benchmark::ReportUnrecognizedArguments(count, arguments))
        return 1;
    print_memory();
    benchmark::RunSpecifiedBenchmarks();
}
