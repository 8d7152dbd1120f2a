// SPDX-License-Identifier: MIT
// Paths of the reference renderer as the path checker reads them.
#pragma once

#include <bpt/media_options.hpp>
#include <cstdio>
#include <cstdlib>
#include <doctest/doctest.h>
#include <lab/render.hpp>
#include <reader.hpp>
#include <unistd.h>

namespace test {

inline std::vector<std::string> dump_of(const lab::scene<double>& scene,
                                        const lab::settings<double>& settings) {
    std::vector<std::string> lines;
    lab::render(scene, settings, [&](const lab::pass_result<double>& result) {
        for (const auto& row : result.rows)
            lines.insert(lines.end(), row.dump.begin(), row.dump.end());
    });
    return lines;
}

inline std::vector<mis::path_record> records_of(const std::vector<std::string>& lines) {
    std::FILE* const file = std::tmpfile();
    REQUIRE(file);
    for (const auto& line : lines)
        std::fprintf(file, "%s\n", line.c_str());
    std::rewind(file);
    check_paths::path_reader reader;
    REQUIRE(check_paths::open_lines(reader.lines, dup(fileno(file))));
    std::vector<mis::path_record> records;
    std::string error;
    for (mis::path_record record;
         check_paths::next_record(reader, record, error) == check_paths::read_status::record;)
        records.push_back(record);
    CHECK(error.empty());
    std::fclose(file);
    return records;
}

// All families of merges in media, with a radius for each dimension; long beams of the camera, short ones of
// the light.
inline bpt::media_merges<double> all_families(const lab::scene<double>& scene, int width) {
    bpt::media_options o;
    o.radius_3d = 0.03;
    o.radius_1d = 0.005;
    o.beam_walks = 100;
    return bpt::media_merges_of("upbp", true, o, 0.01, scene.radius, double(width * width));
}

} // namespace test
