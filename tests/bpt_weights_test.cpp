// The reference renderer's weights, small and quick: three ways agree under every heuristic and mode, results
// do not depend on threads, and a dumped path has all that its weight needs.
#include <doctest/doctest.h>
#include <render.hpp>

namespace {

using namespace bpt;

constexpr heuristic_kind heuristics[] = {heuristic_kind::average, heuristic_kind::balance,
                                         heuristic_kind::power, heuristic_kind::cutoff,
                                         heuristic_kind::maximum};

template <class Real> settings<Real> small_settings(heuristic_kind kind, int width = 12) {
    settings<Real> s;
    s.width = width;
    s.passes = 1;
    s.heuristic = {kind, kind == heuristic_kind::cutoff ? 0.1 : 2.0};
    s.counts = mis::bidirectional(static_cast<Real>(width * width));
    return s;
}

template <class Real> weight_checks checks_of(const std::string& name, const settings<Real>& set) {
    weight_checks checks;
    const scene<Real> scene = make_scene<Real>(name);
    render(scene, set, [&](const pass_result<Real>& result) {
        for (const auto& row : result.rows)
            checks.add(row.checks);
    });
    return checks;
}

} // namespace

TEST_CASE("recursion, densities and throughputs agree: every scene, heuristic and mode") {
    for (const auto& name : scene_names())
        for (const auto kind : heuristics)
            for (const bool random : {false, true}) {
                CAPTURE(name);
                CAPTURE(name_of(kind));
                CAPTURE(random);
                auto in_double = small_settings<double>(kind);
                in_double.random_connection = random;
                in_double.counts.direct = in_double.counts.camera_connection;
                const auto d = checks_of(name, in_double);
                CHECK(d.paths > 100);
                CHECK(d.recursion.largest <= 1e-9);
                CHECK(d.throughput.largest <= 1e-9);
                CHECK(d.sum <= 1e-12);
                CHECK(d.recursion_sum <= 1e-12);
                auto in_float = small_settings<float>(kind);
                in_float.random_connection = random;
                const auto f = checks_of(name, in_float);
                CHECK(f.recursion.largest <= 1e-4);
                CHECK(f.recursion.above_1e_5 * 10000 <= f.recursion.compared);
                CHECK(f.recursion_sum <= 1e-5);
            }
}

TEST_CASE("the number of threads changes nothing, to the last bit") {
    const auto scene = make_scene<double>("lens");
    auto set = small_settings<double>(heuristic_kind::power, 24);
    const auto render_with = [&](int threads) {
        set.threads = threads;
        std::vector<double> numbers;
        render(scene, set, [&](const pass_result<double>& result) {
            for (const auto& row : result.rows)
                for (const auto& c : row.contributions)
                    numbers.insert(numbers.end(),
                                   {double(c.pixel), c.value.x, c.value.y, c.value.z, c.weight});
        });
        return numbers;
    };
    const auto one = render_with(1);
    CHECK(one.size() > 1000);
    CHECK(one == render_with(2));
    CHECK(one == render_with(7));
}

namespace {

// A dumped vertex as a record with positions.
mis::path_vertex<glm::dvec3> vertex_of(const nlohmann::json& j) {
    mis::path_vertex<glm::dvec3> x;
    for (const auto kind : {mis::vertex_kind::camera, mis::vertex_kind::surface, mis::vertex_kind::dirac,
                            mis::vertex_kind::light, mis::vertex_kind::infinite_light})
        if (j.at("kind") == name_of(kind))
            x.kind = kind;
    const auto vector = [&](const char* key) {
        const auto v = j.value(key, std::vector<double>{0, 0, 0});
        return glm::dvec3(v[0], v[1], v[2]);
    };
    x.position = vector("position");
    x.normal = vector(x.kind == mis::vertex_kind::infinite_light ? "direction" : "normal");
    x.dirac =
        j.value("dirac", x.kind == mis::vertex_kind::camera); // the pinhole; no dump asks for camera hits
    x.pdf_to_light = j.value("pdf_to_light", 0.0);
    x.pdf_to_camera = j.value("pdf_to_camera", 0.0);
    x.pdf_position = j.value("pdf_position", 0.0);
    x.pdf_next_event = j.value("pdf_next_event", x.pdf_position);
    return x;
}

} // namespace

TEST_CASE("the weights of dumped paths follow from their positions and densities") {
    for (const auto& name : scene_names()) {
        CAPTURE(name);
        auto set = small_settings<double>(heuristic_kind::power);
        set.dump_paths = 1000;
        int lines = 0;
        double greatest = 0;
        const auto scene = make_scene<double>(name);
        render(scene, set, [&](const pass_result<double>& result) {
            for (const auto& row : result.rows)
                for (const auto& line : row.dump) {
                    const auto j = nlohmann::json::parse(line);
                    std::vector<mis::path_vertex<glm::dvec3>> path;
                    for (const auto& v : j.at("vertices"))
                        path.push_back(vertex_of(v));
                    const int n = static_cast<int>(path.size());
                    mis::technique t{};
                    for (int k = 0; k < mis::technique_count(n); ++k)
                        if (j.at("technique") == name_of(mis::technique_at(n, k).kind) &&
                            mis::technique_at(n, k).camera_vertices == j.at("camera_vertices"))
                            t = mis::technique_at(n, k);
                    const double weight = mis::weight(mis::power, set.counts, path.data(), n, t);
                    greatest = std::max(greatest, std::abs(weight / j.at("weight").get<double>() - 1));
                    CHECK(j.at("counts").at("camera_connection") == set.counts.camera_connection);
                    ++lines;
                }
        });
        CHECK(lines > 100);
        CHECK(greatest < 1e-9);
    }
}
