// The reference renderer's weights, small and quick: three ways agree under every heuristic and mode, results
// do not depend on threads, and a dumped path has all that its weight needs.
#include <array>
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

// With merges too. The radius is a part of the scene's, and large: few light walks are to meet many camera
// walks.
template <class Real>
settings<Real> merging_settings(heuristic_kind kind, const std::string& name, int width = 12,
                                Real radius = Real(0.1)) {
    settings<Real> s = small_settings<Real>(kind, width);
    s.merge_radius = radius * make_scene<Real>(name).radius;
    s.counts = mis::connection_and_merging(static_cast<Real>(width * width), s.merge_radius);
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

TEST_CASE("recursion and densities agree where walks merge") {
    for (const std::string name : {"smooth", "environment", "mixed"})
        for (const auto kind : heuristics) {
            CAPTURE(name);
            CAPTURE(name_of(kind));
            const auto d = checks_of(name, merging_settings<double>(kind, name));
            CHECK(d.paths > 100);
            CHECK(d.recursion.largest <= 1e-9);
            CHECK(d.sum <= 1e-12);
            CHECK(d.recursion_sum <= 1e-12);
            const auto f = checks_of(name, merging_settings<float>(kind, name));
            CHECK(f.recursion.largest <= 1e-4);
            CHECK(f.recursion.above_1e_5 * 10000 <= f.recursion.compared);
            CHECK(f.recursion_sum <= 1e-5);
        }
}

namespace {

template <class Real> std::vector<contribution<Real>> contributions_of(const settings<Real>& set) {
    std::vector<contribution<Real>> all;
    const auto scene = make_scene<Real>("mixed");
    render(scene, set, [&](const pass_result<Real>& result) {
        for (const auto& row : result.rows)
            all.insert(all.end(), row.contributions.begin(), row.contributions.end());
    });
    return all;
}

// Of the weights of light hits and next events in `mixed` with two light samples: those that share equally.
template <class Real> std::array<int, 2> count_ties() {
    auto set = small_settings<Real>(heuristic_kind::maximum, 64);
    set.counts.next_event = 2;
    std::array<int, 2> ties{};
    for (const auto& c : contributions_of(set)) {
        ties[0] += c.technique.kind == mis::technique_kind::light_hit && c.weight == Real(0.5);
        ties[1] += c.technique.kind == mis::technique_kind::next_event && c.weight == Real(0.5);
    }
    return ties;
}

} // namespace

TEST_CASE("light hits and next events tie at the uniform block of `mixed`, exactly") {
    for (const int ties : count_ties<double>())
        CHECK(ties > 10);
    for (const int ties : count_ties<float>())
        CHECK(ties > 10);
}

TEST_CASE("every light sample is taken, and caps leave only the techniques that they allow") {
    auto set = merging_settings<double>(heuristic_kind::power, "mixed");
    const auto next_events = [&] {
        int count = 0;
        for (const auto& c : contributions_of(set))
            count += c.technique.kind == mis::technique_kind::next_event;
        return count;
    };
    const int of_one_sample = next_events();
    set.counts.next_event = 4;
    CHECK(next_events() > 3 * of_one_sample);
    set.counts.max_camera_vertices = 3;
    set.counts.max_light_vertices = 2;
    int longest_camera = 0, longest_light = 0, forbidden = 0, impossible = 0;
    for (const auto& c : contributions_of(set)) {
        const bool merges = c.technique.kind == mis::technique_kind::merge;
        longest_camera = std::max(longest_camera, c.technique.camera_vertices);
        longest_light = std::max(longest_light, c.vertices - c.technique.camera_vertices + (merges ? 1 : 0));
        forbidden += mis::count_of(set.counts, c.vertices, c.technique) == 0;
        impossible += c.weight == 0;
    }
    CHECK(longest_camera == 3);
    CHECK(longest_light == 2);
    CHECK(forbidden == 0);
    CHECK(impossible == 0);
    CHECK(checks_of("mixed", set).recursion.largest <= 1e-9);
}

TEST_CASE("the number of threads changes nothing, to the last bit") {
    const auto scene = make_scene<double>("lens");
    auto set = merging_settings<double>(heuristic_kind::power, "lens", 24);
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

TEST_CASE("merging estimates the same light as the other techniques, but for a small bias") {
    const auto scene = make_scene<double>("smooth");
    auto set = merging_settings<double>(heuristic_kind::balance, "smooth", 32, 0.02);
    set.passes = 16;
    set.check_weights = false;
    const auto mean_of = [&](const mis::technique_counts<double>& counts) {
        set.counts = counts;
        double mean = 0;
        render(scene, set, [&](const pass_result<double>& result) {
            for (const auto& row : result.rows)
                for (const auto& c : row.contributions)
                    mean += c.vertices > 2 ? bpt::sum(c.value) * c.weight : 0;
        });
        return mean;
    };
    const double pixels = 32 * 32, bidirectional = mean_of(mis::bidirectional(pixels));
    // Over 40 seeds, the quotients had means within 0.001 of 1 and standard deviations of 0.018 and 0.007:
    // the bounds are more than five of these away, a false alarm has a probability below 1e-6.
    CHECK(mean_of(mis::photon_mapping(pixels, set.merge_radius)) ==
          doctest::Approx(bidirectional).epsilon(0.1));
    CHECK(mean_of(mis::connection_and_merging(pixels, set.merge_radius)) ==
          doctest::Approx(bidirectional).epsilon(0.04));
}

TEST_CASE("a merge has the directions of the camera's vertex and the survival of the walk that would go on") {
    const glm::dvec3 up(0, 1, 0), sideways = normalize(glm::dvec3(1, 2, 0));
    material<double> camera_side, light_side;
    camera_side.diffuse = light_side.diffuse = glm::dvec3(0.5);
    camera_side.survival = 0.75;
    light_side.survival = 0.25;
    vertex<double> x, photon;
    x.material = &camera_side;
    x.point.normal = x.point.shading_normal = up;
    x.towards_previous = sideways;
    photon.material = &light_side;
    photon.point.normal = photon.point.shading_normal = sideways;
    photon.towards_previous = up;
    photon.record.cos_to_light = 0.3;
    photon.record.distance2_to_light = 5;
    complete_merge(x, photon);
    CHECK(x.record.pdf_to_light == doctest::Approx(0.75 / pi<double>));
    CHECK(x.record.pdf_to_camera == doctest::Approx(0.25 * sideways.y / pi<double>));
    CHECK(x.record.cos_to_light == 0.3);
    CHECK(x.record.distance2_to_light == 5);
}

TEST_CASE("a merge treats shading normals as the light walk does") {
    material<double> diffuse;
    diffuse.diffuse = glm::dvec3(0.5);
    vertex<double> photon;
    photon.material = &diffuse;
    photon.point.normal = glm::dvec3(0, 1, 0);
    photon.point.shading_normal = normalize(glm::dvec3(0.3, 1, 0));
    photon.towards_previous = normalize(glm::dvec3(-0.5, 1, 0.2));
    const glm::dvec3 to = normalize(glm::dvec3(0.7, 1, -0.1));
    const auto f = evaluate(diffuse, photon.point, photon.towards_previous, to);
    CHECK(scattered(photon, to, walk_kind::from_light).x ==
          doctest::Approx(f.x * adjoint_factor(photon) * geometric_cosine(photon, to)));
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

namespace {

// A dumped vertex as a record with the cosines and distances that the renderer has measured: positions say
// nothing of the edge that starts at a merge's photon.
mis::measured_vertex<double> measured_vertex_of(const nlohmann::json& j) {
    const mis::path_vertex<glm::dvec3> x = vertex_of(j);
    mis::measured_vertex<double> m;
    m.kind = x.kind;
    m.dirac = x.dirac;
    m.pdf_to_light = x.pdf_to_light;
    m.pdf_to_camera = x.pdf_to_camera;
    m.pdf_position = x.pdf_position;
    m.pdf_next_event = x.pdf_next_event;
    m.cos_to_camera = j.value("cos_to_camera", 1.0);
    m.cos_to_light = j.value("cos_to_light", 1.0);
    const double distance = j.value("distance", 1.0);
    m.distance2_to_light = distance * distance;
    return m;
}

} // namespace

TEST_CASE("the weights of dumped merges follow from what is dumped") {
    constexpr int width = 24;
    auto set = merging_settings<double>(heuristic_kind::power, "mixed", width);
    set.dump_paths = 1000;
    int merges = 0;
    double greatest = 0, farthest = 0, disagreement = 0;
    render(make_scene<double>("mixed"), set, [&](const pass_result<double>& result) {
        for (const auto& row : result.rows)
            for (const auto& line : row.dump) {
                const auto j = nlohmann::json::parse(line);
                if (j.at("technique") != "merge")
                    continue;
                ++merges;
                CHECK(j.at("counts").at("merge") == width * width);
                auto counts = mis::bidirectional(double(width) * width);
                counts.merge = j.at("counts").at("merge");
                counts = mis::times_merge_area(counts, j.at("radius").get<double>());
                std::vector<mis::measured_vertex<double>> path;
                for (const auto& v : j.at("vertices"))
                    path.push_back(measured_vertex_of(v));
                const int s = j.at("camera_vertices"), n = static_cast<int>(path.size());
                const double weight =
                    mis::weight(mis::power, counts, path.data(), n, {mis::technique_kind::merge, s});
                greatest = std::max(greatest, std::abs(weight / j.at("weight").get<double>() - 1));

                // The photon is near the vertex, and the edge to the light starts there.
                const auto& x = j.at("vertices").at(static_cast<std::size_t>(s - 1));
                const auto& next = j.at("vertices").at(static_cast<std::size_t>(s));
                const auto photon = vertex_of({{"kind", "surface"},
                                               {"position", x.at("photon").at("position")},
                                               {"normal", x.at("photon").at("normal")}});
                farthest =
                    std::max(farthest, length(photon.position - vertex_of(x).position) / set.merge_radius);
                CHECK(x.at("photon").at("survival") > 0);
                const mis::path_vertex<glm::dvec3> edge[] = {photon, vertex_of(next)};
                const auto start = mis::measure(edge, 2, 0);
                const auto& stored = path[static_cast<std::size_t>(s - 1)];
                disagreement = std::max({disagreement, std::abs(start.cos_to_light - stored.cos_to_light),
                                         std::abs(start.distance2_to_light / stored.distance2_to_light - 1)});
            }
    });
    CHECK(merges > 100);
    CHECK(greatest < 1e-9);
    CHECK(farthest < 1);
    CHECK(disagreement < 1e-9);
}
