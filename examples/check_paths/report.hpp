// What a check of a renderer's weights has found, as text and as JSON.
#pragma once

#include "reader.hpp"
#include <cstdint>
#include <cstdio>
#include <map>
#include <mis/verify/diagnosis.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

namespace check_paths {

// Records of one technique and path length.
struct tally {
    std::int64_t records = 0, agreeing = 0, disagreeing = 0, undecided = 0, unusable = 0;
    double largest_error = 0; // relative to the larger weight, of those that agree or not; infinite for NaN
};

// Something about one line of the input.
struct remark {
    std::int64_t line = 0;
    std::string what;
};

struct report {
    mis::diagnosis diagnosis;
    std::map<std::pair<mis::technique_kind, int>, tally> tallies; // by technique and number of vertices
    tally all;

    // The first few of each kind.
    std::vector<remark> disagreeing, no_numbers, unusable, malformed;
    std::int64_t weights_no_numbers = 0; // NaN, infinite or negative
    std::int64_t malformed_lines = 0;
    std::int64_t incomplete = 0; // of the unusable records, those that lack a density
    std::string failure;         // why reading ended early

    mis::path_record record; // reused from line to line
};

// Reads the next line that is not blank and compares its weight with the right one. False where nothing
// follows: at the end of the input, where it breaks off, which then is the report's failure, or for now,
// where reader.lines is waiting.
bool add_next(report& r, path_reader& reader);

// Gives up where more lines than this are no records.
inline constexpr std::int64_t default_most_malformed = 10'000;

// Reads the input to its end, or as far as it is there, or gives up; look() is called after each line.
template <class Look> void add_all(report& r, path_reader& reader, std::int64_t most_malformed, Look&& look) {
    while (add_next(r, reader)) {
        look();
        if (r.malformed_lines > most_malformed) {
            r.failure = "given up: more than " + std::to_string(most_malformed) + " lines are no records";
            return;
        }
    }
}

// In one line, why not all of the file has been checked, or nothing of it. Empty where all has.
std::string complaint(const report& r, const std::string& file);

// Searches for the mistakes that explain the weights that disagree, with a few examples for each.
mis::finding suspects_in(const report& r, std::size_t examples);

// 0: all weights agree; 1: some do not, or there is a suspect without any such weight, as for ties of the
// maximum heuristic; 2: some of the input, or all of it, could not be read or lacks densities, whatever the
// rest says.
int exit_status(const report& r, const mis::finding& found);

void print(const report& r, const mis::finding& found, std::FILE* out);
nlohmann::ordered_json to_json(const report& r, const mis::finding& found);

} // namespace check_paths
