// SPDX-License-Identifier: MIT
#include <array>
#include <cmath>
#include <cstdio>
#include <doctest/doctest.h>
#include <fstream>
#include <mis/path.hpp>
#include <mis/verify/subpaths.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

// Weighted paths that a public renderer with vertex connection and merging has written out. Its weights come
// from its own three numbers per vertex in float; ours from the records, by both forms.

namespace {

using json = nlohmann::json;

struct vec {
    double x = 0, y = 0, z = 0;
};
vec operator-(const vec& a, const vec& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
double dot(const vec& a, const vec& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

using vertex = mis::path_vertex<vec>;

vec vector_of(const json& record, const char* key) {
    if (!record.contains(key))
        return {};
    const auto v = record[key].get<std::array<double, 3>>();
    return {v[0], v[1], v[2]};
}

mis::vertex_kind kind_of(const std::string& name) {
    if (name == "camera")
        return mis::vertex_kind::camera;
    if (name == "dirac")
        return mis::vertex_kind::dirac;
    if (name == "medium")
        return mis::vertex_kind::medium;
    if (name == "light")
        return mis::vertex_kind::light;
    if (name == "infinite_light")
        return mis::vertex_kind::infinite_light;
    REQUIRE(name == "surface");
    return mis::vertex_kind::surface;
}

vertex vertex_of(const json& record) {
    vertex v;
    v.kind = kind_of(record["kind"]);
    v.dirac = record.value("dirac", false);
    v.position = vector_of(record, "position");
    v.normal = vector_of(record, v.kind == mis::vertex_kind::infinite_light ? "direction" : "normal");
    v.pdf_to_light = record.value("pdf_to_light", 0.0);
    v.pdf_to_camera = record.value("pdf_to_camera", 0.0);
    v.pdf_position = record.value("pdf_position", 0.0);
    v.pdf_next_event =
        record.value("pdf_next_event", v.kind == mis::vertex_kind::camera ? v.pdf_position : 0.0);
    return v;
}

mis::technique technique_of(const json& record) {
    const std::string name = record["technique"];
    const int s = record["camera_vertices"];
    if (name == "light_hit")
        return {mis::technique_kind::light_hit, s};
    if (name == "next_event")
        return {mis::technique_kind::next_event, s};
    if (name == "camera_connection")
        return {mis::technique_kind::camera_connection, s};
    if (name == "merge")
        return {mis::technique_kind::merge, s};
    REQUIRE(name == "connection");
    return {mis::technique_kind::connection, s};
}

mis::technique_counts<double> counts_of(const json& record) {
    const json& c = record["counts"];
    mis::technique_counts<double> counts;
    counts.light_hit = c.value("light_hit", 0.0);
    counts.next_event = c.value("next_event", 0.0);
    counts.connection = c.value("connection", 0.0);
    counts.camera_connection = c.value("camera_connection", 0.0);
    counts.merge = c.value("merge", 0.0);
    return counts.merge > 0 ? mis::times_merge_area(counts, record["radius"].get<double>()) : counts;
}

// A merge's two walks arrive at slightly different points: edges on the light's side start at the photon.
std::vector<mis::measured_vertex<double>> measured(const json& record) {
    std::vector<vertex> path, from_photon;
    for (const json& v : record["vertices"])
        path.push_back(vertex_of(v));
    const int n = static_cast<int>(path.size());
    std::vector<mis::measured_vertex<double>> result;
    for (int i = 0; i < n; ++i)
        result.push_back(mis::measure(path.data(), n, i));
    for (int i = 0; i < n; ++i) {
        const json& v = record["vertices"][static_cast<std::size_t>(i)];
        if (!v.contains("photon"))
            continue;
        auto moved = path;
        const auto at = static_cast<std::size_t>(i);
        moved[at].position = vector_of(v["photon"], "position");
        moved[at].normal = vector_of(v["photon"], "normal");
        const auto photon = mis::measure(moved.data(), n, i);
        result[at].cos_to_light = photon.cos_to_light;
        result[at].distance2_to_light = photon.distance2_to_light;
        result[at + 1].cos_to_camera = mis::measure(moved.data(), n, i + 1).cos_to_camera;
    }
    return result;
}

template <class Heuristic> std::array<double, 2> weights_of(const Heuristic& h, const json& record) {
    const auto path = measured(record);
    const int n = static_cast<int>(path.size());
    const auto counts = counts_of(record);
    const mis::technique t = technique_of(record);
    return {mis::weight(h, counts, path.data(), n, t), mis::weight_in_subpaths(h, counts, path.data(), n, t)};
}

} // namespace

TEST_CASE("the weights of a published renderer's paths") {
    std::ifstream file(MIS_RENDERER_PATHS);
    if (!file) {
        std::printf("skipped: no paths of a published renderer at %s\n", MIS_RENDERER_PATHS);
        return;
    }
    double worst = 0;
    int count = 0, powers = 0;
    for (std::string line; std::getline(file, line);) {
        if (line.empty())
            continue;
        const json record = json::parse(line);
        const std::string heuristic = record["heuristic"];
        REQUIRE((heuristic == "balance" || heuristic == "power"));
        const auto w = heuristic == "balance"
                           ? weights_of(mis::balance, record)
                           : weights_of(mis::power_heuristic{record["beta"].get<double>()}, record);
        powers += heuristic == "power";
        const double published = record["weight"];
        CAPTURE(count);
        CAPTURE(record["technique"].get<std::string>());
        for (double ours : w) {
            const double error = std::fabs(ours - published) / published;
            CHECK(error <= 1e-4);
            worst = std::max(worst, error);
        }
        ++count;
    }
    std::printf("%d published weights, %d of them power: at most %.2g relative apart\n", count, powers,
                worst);
    CHECK(count >= 48);
}
