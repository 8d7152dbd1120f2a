// The reference renderer's weights, small and quick: three ways agree under every heuristic and mode, results
// do not depend on threads, and a dumped path has all that its weight needs.
#include "lab_checks.hpp"

#include <array>
#include <bpt/algorithms.hpp>
#include <cstdio>
#include <doctest/doctest.h>
#include <lab/pictures.hpp>

namespace {

using namespace lab;
using lab::renderer, lab::settings;

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

// Two passes, of which the second has a smaller radius.
template <class Real> settings<Real> progressive(settings<Real> s) {
    s.passes = 2;
    s.radius_alpha = mis::optimal_alpha<Real>;
    return s;
}

template <class Real> weight_checks checks_of(const std::string& name, const settings<Real>& set) {
    return test::checks_of(make_scene<Real>(name), set);
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
                test::check_agreement(checks_of(name, in_double));
                auto in_float = small_settings<float>(kind);
                in_float.random_connection = random;
                const auto f = checks_of(name, in_float);
                CHECK(f.recursion.largest <= 1e-4);
                CHECK(f.recursion.above_1e_5 * 10000 <= f.recursion.compared);
                CHECK(f.recursion_sum <= 1e-5);
            }
}

TEST_CASE("recursion, densities and throughputs agree where walks merge") {
    for (const std::string name : {"glossy", "smooth", "environment", "mixed", "caustic"})
        for (const auto kind : heuristics) {
            CAPTURE(name);
            CAPTURE(name_of(kind));
            test::check_agreement(checks_of(name, merging_settings<double>(kind, name)));
            const auto f = checks_of(name, merging_settings<float>(kind, name));
            CHECK(f.recursion.largest <= 1e-4);
            CHECK(f.recursion.above_1e_5 * 10000 <= f.recursion.compared);
            CHECK(f.recursion_sum <= 1e-5);
        }
}

namespace {

template <class Real>
std::vector<weighed_contribution<Real>> contributions_of(const settings<Real>& set,
                                                         const std::string& name = "mixed") {
    std::vector<weighed_contribution<Real>> all;
    const auto scene = make_scene<Real>(name);
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

// All that a renderer's contributions consist of, to be compared exactly.
template <class Real>
std::vector<Real> numbers_of(const std::vector<weighed_contribution<Real>>& contributions) {
    std::vector<Real> numbers;
    for (const auto& c : contributions)
        numbers.insert(numbers.end(),
                       {static_cast<Real>(c.technique.kind), static_cast<Real>(c.technique.camera_vertices),
                        static_cast<Real>(c.vertices), static_cast<Real>(c.pixel), c.value.x, c.value.y,
                        c.value.z, c.weight});
    return numbers;
}

} // namespace

TEST_CASE("where each camera walk merges once, no path is made in two ways") {
    for (const std::string name : {"mixed", "caustic"})
        for (const auto kind : heuristics) {
            auto set = progressive(merging_settings<double>(kind, name, 24));
            set.counts = mis::photon_mapping(24.0 * 24.0, set.merge_radius);
            set.merges_once = true;
            const auto d = checks_of(name, set); // the densities are those of walks that end there
            CHECK(d.paths > 100);
            CHECK(d.recursion.largest == 0);
            CHECK(d.throughput.largest == 0);
            CHECK(d.sum == 0);
            set.check_weights = false; // and no path has to be looked at
            int merges = 0;
            for (const auto& c : contributions_of(set, name)) {
                CHECK(c.weight == 1);
                merges += c.technique.kind == mis::technique_kind::merge;
            }
            CHECK(merges > 100);
        }
}

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
    for (const bool checked : {true, false}) {
        auto set = progressive(merging_settings<double>(heuristic_kind::power, "lens", 24));
        set.check_weights = checked;
        const auto render_with = [&](int threads) {
            set.threads = threads;
            return numbers_of(contributions_of(set, "lens"));
        };
        const auto one = render_with(1);
        CHECK(one.size() > 1000);
        CHECK(one == render_with(2));
        CHECK(one == render_with(7));
    }
}

TEST_CASE("looking at paths changes nothing, to the last bit") {
    const auto compare = [](auto set) {
        const auto looked_at = numbers_of(contributions_of(set));
        CHECK(looked_at.size() > 1000);
        set.check_weights = false;
        CHECK(numbers_of(contributions_of(set)) == looked_at);
    };
    compare(progressive(merging_settings<double>(heuristic_kind::power, "mixed")));
    compare(progressive(merging_settings<float>(heuristic_kind::maximum, "mixed")));
}

TEST_CASE("the renderer alone makes the laboratory's image, to the last bit, with any path_weights") {
    const auto scene = make_scene<float>("mixed");
    auto set = progressive(merging_settings<float>(heuristic_kind::power, "mixed"));
    film looked_at(set.width), alone(set.width);
    render(scene, set, [&](const pass_result<float>& result) {
        for (const auto& row : result.rows)
            for (const auto& c : row.contributions)
                looked_at.sum.pixels[static_cast<std::size_t>(c.pixel)] +=
                    glm::dvec3(c.value) * static_cast<double>(c.weight);
    });
    bpt::renderer renderer(scene, set, mis::power);
    while (alone.passes < set.passes)
        add_pass(renderer, alone);
    CHECK(alone.sum.pixels == looked_at.sum.pixels);
    CHECK(alone.sum.pixels != black(set.width).pixels);
}

TEST_CASE("whole paths are there for everybody who looks at them") {
    const auto scene = make_scene<double>("mixed");
    const auto looks = [&](auto change) {
        auto set = merging_settings<double>(heuristic_kind::power, "mixed");
        set.check_weights = false;
        change(set);
        return looks_at_paths(make_renderer(scene, set), set);
    };
    CHECK(!looks([](auto&) {}));
    CHECK(looks([](auto& set) { set.check_weights = true; }));
    CHECK(looks([](auto& set) { set.dump_paths = 1; }));
    CHECK(looks([](auto& set) { set.mistakes.planted.set(0); }));
    CHECK(looks([](auto& set) { set.heuristic = {heuristic_kind::cutoff, 0.1}; }));
    CHECK(looks([](auto& set) { set.counts.max_light_vertices = 3; }));
}

TEST_CASE("algorithms are sets of counts") {
    const auto all = algorithms(100.0, 0.1);
    struct expected {
        const char* name;
        bool light_hit, next_event, connection, camera_connection, merge, is_progressive;
    };
    for (const auto& e : {expected{"pt", true, false, false, false, false, false},
                          {"pt-nee", true, true, false, false, false, false},
                          {"lt", false, false, false, true, false, false},
                          {"bpt", true, true, true, true, false, false},
                          {"ppm", true, false, false, false, true, true},
                          {"sppm", true, false, false, false, true, true},
                          {"bpm", true, false, false, false, true, false},
                          {"ups", true, true, true, true, true, true},
                          {"vcm", true, true, true, true, true, true}}) {
        CAPTURE(e.name);
        const auto& a = all.at(e.name);
        CHECK(a.counts.light_hit == (e.light_hit ? 1 : 0));
        CHECK(a.counts.next_event == (e.next_event ? 1 : 0));
        CHECK(a.counts.connection == (e.connection ? 1 : 0));
        CHECK(a.counts.camera_connection == (e.camera_connection ? 100 : 0));
        CHECK(a.counts.merge == doctest::Approx(e.merge ? pi<double> : 0));
        CHECK(a.is_progressive == e.is_progressive);
    }
    const auto pt_nee = one_light_vertex(all.at("bpt").counts);
    CHECK(pt_nee.connection == 0);
    CHECK(pt_nee.camera_connection == 0);
    CHECK(pt_nee.next_event == 1);
    CHECK(one_light_vertex(all.at("ups").counts).merge == all.at("ups").counts.merge);
    CHECK(has_technique(all.at("lt").counts));
    CHECK(!has_technique(one_light_vertex(all.at("lt").counts)));
}

TEST_CASE("with one light vertex, only merges know longer light walks") {
    auto set = merging_settings<double>(heuristic_kind::power, "mixed");
    set.counts = one_light_vertex(set.counts);
    int longer = 0, merges = 0;
    for (const auto& c : contributions_of(set)) {
        const bool is_merge = c.technique.kind == mis::technique_kind::merge;
        merges += is_merge;
        longer += !is_merge && c.vertices - c.technique.camera_vertices > 1;
    }
    CHECK(longer == 0);
    CHECK(merges > 100);
}

TEST_CASE("images are read as they were written, and compared by the root of the mean square") {
    film film(2);
    film.passes = 2;
    film.sum.pixels = {{1, 2, 3}, {0, 0.5, 8}, {0.25, 0, 0}, {4, 4, 4}};
    const std::string file = "bpt_weights_test.exr";
    bpt::write_exr(file, film);
    image read = read_exr(file, 2);
    CHECK_THROWS_AS(read_exr(file, 3), std::runtime_error);
    CHECK_THROWS_AS(read_exr(file + ".no", 2), std::runtime_error);
    std::remove(file.c_str());
    CHECK(read.pixels[1].y == 0.25);
    CHECK(read.pixels[2].x == 0.125);
    CHECK(rms_error(film, read) == 0);
    read.pixels[0].x += 3;
    read.pixels[3].z -= 4;
    CHECK(rms_error(film, read) == doctest::Approx(std::sqrt((9 + 16) / 12.0)));
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
                    mean += c.vertices > 2 ? lab::sum(c.value) * c.weight : 0;
        });
        return mean;
    };
    const double pixels = 32 * 32, bidirectional = mean_of(mis::bidirectional(pixels));
    // Over 25 and more seeds, the quotients had means within 0.003 of 1 and standard deviations of 0.020 and
    // 0.007; with radii that shrink, of 0.028, 0.006 and 0.009: the bounds are about five and more of these
    // away, a false alarm has a probability below 2e-6.
    const auto all = algorithms(pixels, set.merge_radius);
    CHECK(mean_of(all.at("bpm").counts) == doctest::Approx(bidirectional).epsilon(0.1));
    CHECK(mean_of(all.at("ups").counts) == doctest::Approx(bidirectional).epsilon(0.04));
    set.radius_alpha = mis::optimal_alpha<double>;
    CHECK(mean_of(all.at("ppm").counts) == doctest::Approx(bidirectional).epsilon(0.15));
    CHECK(mean_of(all.at("ups").counts) == doctest::Approx(bidirectional).epsilon(0.04));
    CHECK(mean_of(one_light_vertex(all.at("ups").counts)) == doctest::Approx(bidirectional).epsilon(0.05));
}

TEST_CASE("a merge has the directions of the camera's vertex and the survival of the walk that would go on") {
    const glm::dvec3 up(0, 1, 0), sideways = normalize(glm::dvec3(1, 2, 0));
    material<double> camera_side, light_side;
    camera_side.diffuse = light_side.diffuse = glm::dvec3(0.5);
    camera_side.survival = 0.75;
    light_side.survival = 0.25;
    vertex<double> x, light;
    x.material = &camera_side;
    x.point.normal = x.point.shading_normal = up;
    x.towards_previous = sideways;
    light.material = &light_side;
    light.point.normal = light.point.shading_normal = sideways;
    light.towards_previous = up;
    std::vector<photon<double>> photons;
    add_photons<double>({vertex<double>{}, light}, 0, photons);
    const auto& photon = photons.at(0);
    CHECK(merge_density_to_light(x, photon.towards_previous).value == doctest::Approx(0.75 / pi<double>));
    CHECK(merge_density_to_camera(x, photon.towards_previous, photon.survival).value ==
          doctest::Approx(0.25 * sideways.y / pi<double>));
}

TEST_CASE("a merge treats shading normals as the light walk does") {
    material<double> diffuse;
    diffuse.diffuse = glm::dvec3(0.5);
    vertex<double> end;
    end.throughput = color<double>(2);
    end.material = &diffuse;
    end.point.normal = glm::dvec3(0, 1, 0);
    end.point.shading_normal = normalize(glm::dvec3(0.3, 1, 0));
    end.towards_previous = normalize(glm::dvec3(-0.5, 1, 0.2));
    const glm::dvec3 to = normalize(glm::dvec3(0.7, 1, -0.1));
    const auto f = evaluate(diffuse, end.point, end.towards_previous, to);
    std::vector<photon<double>> photons;
    add_photons<double>({vertex<double>{}, end}, 0, photons);
    const double merged = f.x * photons.at(0).throughput.x * geometric_cosine(end, to);
    CHECK(2 * scattered(end, to, walk_kind::from_light).x == doctest::Approx(merged));
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

// The technique of a dumped path of n vertices.
mis::technique technique_of(const nlohmann::json& j, int n) {
    mis::technique found{};
    for (int k = 0; k < mis::technique_count(n); ++k)
        if (const mis::technique t = mis::technique_at(n, k);
            j.at("technique") == name_of(t.kind) && j.at("camera_vertices") == t.camera_vertices)
            found = t;
    return found;
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
                    const mis::technique t = technique_of(j, n);
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

TEST_CASE("the weights of dumped paths follow from what is dumped, each pass' radius included") {
    constexpr int width = 24;
    auto set = progressive(merging_settings<double>(heuristic_kind::power, "mixed", width));
    set.passes = 4;
    set.dump_paths = 1000;
    int merges = 0;
    double greatest = 0, farthest = 0, disagreement = 0;
    render(make_scene<double>("mixed"), set, [&](const pass_result<double>& result) {
        for (const auto& row : result.rows)
            for (const auto& line : row.dump) {
                const auto j = nlohmann::json::parse(line);
                const double radius = j.at("radius");
                CHECK(radius == doctest::Approx(set.merge_radius * std::pow(result.pass + 1, -1 / 6.0)));
                CHECK(j.at("counts").at("merge") == width * width);
                auto counts = mis::bidirectional(double(width) * width);
                counts.merge = j.at("counts").at("merge");
                counts = mis::times_merge_area(counts, radius);
                std::vector<mis::measured_vertex<double>> path;
                for (const auto& v : j.at("vertices"))
                    path.push_back(measured_vertex_of(v));
                const int s = j.at("camera_vertices"), n = static_cast<int>(path.size());
                const mis::technique t = technique_of(j, n);
                const double weight = mis::weight(mis::power, counts, path.data(), n, t);
                greatest = std::max(greatest, std::abs(weight / j.at("weight").get<double>() - 1));
                if (t.kind != mis::technique_kind::merge)
                    continue;
                ++merges;

                // The photon is near the vertex, and the edge to the light starts there.
                const auto& x = j.at("vertices").at(static_cast<std::size_t>(s - 1));
                const auto& next = j.at("vertices").at(static_cast<std::size_t>(s));
                const auto photon = vertex_of({{"kind", "surface"},
                                               {"position", x.at("photon").at("position")},
                                               {"normal", x.at("photon").at("normal")}});
                farthest = std::max(farthest, length(photon.position - vertex_of(x).position) / radius);
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
