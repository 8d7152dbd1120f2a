// Every C++ block of README.md and docs/ that is no part of another file stands here, where it compiles.
// docs_test.cpp compares them. What a renderer would have around them is made up.
#include <array>
#include <cstdio>
#include <doctest/doctest.h>
#include <lab/optimal.hpp>
#include <lab/weigh.hpp>
#include <mis/allocation.hpp>
#include <mis/media.hpp>
#include <mis/mis.hpp>
#include <mis/optimal.hpp> // the only part that needs Eigen
#include <mis/roulette.hpp>
#include <mis/sequence.hpp>
#include <mis/verify.hpp>
#include <optional>
#include <pcg_random.hpp>
#include <random>
#include <sstream>

namespace {

const float pi = 3.14159265f;
const float n_light = 2, n_bsdf = 1, n_guide = 1, p_light = 0.5f, p_bsdf = 2, p_guide = 1;
const float Le = 3, throughput = 0.5f;

// GoogleTest's, for one line.
struct expectation {
    template <class T> expectation& operator<<(const T&) { return *this; }
};
#define EXPECT_TRUE(condition) expectation() << static_cast<bool>(condition)

// A path of four vertices, with densities per area.
std::array<mis::area_vertex<double>, 4> some_path() {
    std::array<mis::area_vertex<double>, 4> path;
    for (auto& x : path)
        x.density_from_camera = x.density_from_light = x.next_event = 1;
    path.front().kind = mis::vertex_kind::camera;
    path.front().dirac = true;
    path.back().kind = mis::vertex_kind::light;
    return path;
}
const mis::technique_counts<double> counts = mis::bidirectional(100.0);
const auto path_of_4 = some_path();
const auto* const path = path_of_4.data();
const auto* const vertices = path;
const int n = 4;
const mis::technique t{mis::technique_kind::connection, 2};

double my_weight(mis::technique of) { return mis::weight(mis::power, counts, path, n, of); }

} // namespace

TEST_CASE("README, path tracer") {
    float Ld = 0, L = 0;
    const float f = 1;
    // clang-format off
Ld += f * Le / p_light * mis::power(n_light * p_light, n_bsdf * p_bsdf); // weight of the first

// next event: a light point was sampled with density p_light; the BSDF would have sampled this direction with p_bsdf
Ld += f * Le / p_light * mis::power(p_light, p_bsdf);

// the BSDF's own sample has hit an emitter; the light sampler would have taken this point with p_light
L += throughput * Le * mis::power(p_bsdf, p_light);

mis::power(p_bsdf, p_light); // per solid angle, as many samples of each; weight of the BSDF sample

const float q[3] = {n_light * p_light, n_bsdf * p_bsdf, n_guide * p_guide}; // at this direction, all three
L += f * Le / p_guide / n_guide * mis::weight(mis::balance, q, 2);          // the sample came from the third

float w[3];
mis::weights(mis::power, q, w);
assert(std::abs(w[0] + w[1] + w[2] - 1) < 1e-6f);
    // clang-format on
    CHECK(std::abs(w[0] + w[1] + w[2] - 1) < 1e-6f);
    CHECK(Ld + L > 0);
    const float area = 2, cos_light = 0.5f, distance2 = 4;
    {
        const auto p_light = mis::to_solid_angle(mis::per_area{1 / area}, cos_light, distance2).value;
        CHECK(p_light == 4);
    }
}

TEST_CASE("README, bidirectional") {
    const int pixels = 100;
    const float d2 = 4, cos_in = 0.5f, cos_out = 0.5f, p = 0.3f, q = 0.3f;
    float w = 0;
    {
        const mis::path_weights weigh{mis::power, mis::bidirectional(float(pixels))};
        const mis::end_point<float> lens{mis::pdf_position{1.f}, mis::pdf_next_event{1.f},
                                         mis::pdf_direction{9.f}, mis::cosine{1.f}, false};
        auto state = weigh.start_camera(lens);
        // clang-format off
state = weigh.arrive(state, mis::squared_distance{d2}, mis::cosine{cos_in}); // at each hit
state = weigh.scatter(state, mis::cosine{cos_out}, mis::pdf_forward{p}, mis::pdf_reverse{q});
        // clang-format on
        const mis::subpath_end<float> camera_end{state, mis::cosine{cos_in}, mis::pdf_forward{p},
                                                 mis::pdf_reverse{q}},
            light_end = camera_end;
        // clang-format off
w = weigh.connection(camera_end, light_end, mis::squared_distance{d2}); // or next_event, light_hit, merge, ...
                                                         // clang-format on
    }
    {
        // clang-format off
const auto counts = mis::bidirectional(float(pixels)); // one light walk per pixel
const mis::path_weights weigh{mis::power, counts};
        // clang-format on
        CHECK(weigh.counts.camera_connection == 100);
    }
    CHECK(w > 0);
    double weights[2 * n - 1];
    mis::weights(mis::balance, counts, vertices, n, weights); // 2n - 1 of them
    CHECK(weights[0] == 0);
    CHECK(mis::path_tracing().light_hit == 1);
    CHECK(mis::path_tracing_next_event().next_event == 1);
}

TEST_CASE("merging and bias") {
    const float light_walks = 100, radius = 0.1f;
    {
        // clang-format off
const auto counts = mis::connection_and_merging(light_walks, radius); // was mis::bidirectional(light_walks)
        // clang-format on
        CHECK(counts.merge > 0);
    }
    auto counts = mis::bidirectional(light_walks);
    // clang-format off
counts = mis::times_merge_area(counts, radius);      // what connection_and_merging does
counts = mis::divided_by_merge_area(counts, radius);
    // clang-format on
    const float r1 = 0.1f, n = 10, p = 2, A = 1, q_other = 20;
    float r2 = r1 * r1;
    const int i = 2;
    {
        // clang-format off
const float r = mis::progressive_radius(r1, i);     // r_1 i^((α − 1) / 2), iteration i = 1, 2, …
r2 = mis::next_squared_radius(r2, i);               // or step by step: r²ᵢ₊₁ = r²ᵢ (i + α) / (i + 1)
        // clang-format on
        CHECK(r < r1);
    }
    const float r = 0.1f;
    // clang-format off
const float q_merge = mis::bias_aware_density(n * p, r, A);  // n p / ((1 + r)² + n p A r²)
const float w = mis::balance(q_merge, q_other);                 // as ever
    // clang-format on
    CHECK(w < 0.5f);
}

TEST_CASE("optimal weights") {
    const std::array<double, 3> f{1, 1, 1};
    const int i = 0;
    std::array<double, 3> sum{};
    {
        // clang-format off
mis::optimal::estimator<2> pixel; // two techniques, three channels

// each sample, whatever technique has made it
const double q[] = {n_light * p_light, n_bsdf * p_bsdf}; // effective densities, as for any other heuristic
pixel.add(f, q);                                         // f, not f / p; also where f is 0

// each draw of technique i that found nothing anybody could have sampled
pixel.add_outside(i);

// at the end
const double counts[] = {n_light, n_bsdf};
        // clang-format on
        std::array<double, 3> color;
        color = mis::optimal::integral(pixel, counts);
        sum = color;
    }
    {
        mis::optimal::estimator<2> pixel;
        const double q[] = {1, 2};
        pixel.add(f, q); // every sample: f, and n p of both techniques
        CHECK(mis::optimal::integral(pixel, q)[0] > 0);
    }
    CHECK(sum[0] > 0);
    const double q[] = {1, 2}, counts[] = {1, 1};
    const int passes = 1;
    {
        std::array<double, 3> color;
        // clang-format off
mis::optimal::progressive<2> pixel;

// each sample of each pass of a batch; and add_outside
pixel.add(f, q);

// each batch
mis::optimal::end_batch(pixel, counts, passes);

// at the end
color = mis::optimal::integral(pixel);
        // clang-format on
        CHECK(color[0] > 0);
    }
    {
        const auto counts = mis::bidirectional(4.0);
        const double merge_radius = 0;
        const int width = 2, tile = 1, threads = 1;
        glm::dvec3 pixel(0);
        const lab::balanced_sample sample{0, 3, 1, glm::dvec3(0.5), {0, 0.5, 0.5}};
        // clang-format off
lab::optimal_weights weights(counts, merge_radius, width, tile); // pixels of a tile share their coefficients

pixel += weights.add(sample); // a contribution and all its balance weights

weights.end_pass();
weights.solve(threads); // for the passes to come: unbiased
        // clang-format on
        CHECK(pixel.x == 0.5);
    }
}

TEST_CASE("unit tests") {
    const double claimed = my_weight(t);
    {
        const auto r = mis::verify::partition_of_unity(counts, vertices, n, my_weight);
        CHECK_MESSAGE(r, r.message); // doctest; EXPECT_TRUE(r) << r.message in GoogleTest
    }
    {
        // clang-format off
const auto r = mis::verify::weight(mis::power, counts, path, n, t, claimed);
CHECK_MESSAGE(r, r.message);      // doctest
EXPECT_TRUE(r) << r.message;      // GoogleTest
                                     // clang-format on
    }
    const double weights[] = {0.5, 0.25, 0.25};
    // clang-format off
const auto sum = mis::verify::partition_of_unity(counts, path, n, [&](mis::technique t) { return my_weight(t); });
const auto any = mis::verify::partition_of_unity(weights, 3); // any array, or a callable weights(i)

const auto one = mis::verify::weight(mis::power, counts, path, n, t, my_weight(t), 1e-3);
    // clang-format on
    CHECK(sum);
    CHECK(any);
    CHECK(one);
    const double radius = 0.1;
    const auto my_throughput = [](mis::technique of) {
        if (of.kind == mis::technique_kind::camera_hit) // a pinhole
            return std::numeric_limits<double>::infinity();
        return of.kind == mis::technique_kind::merge ? 1 / mis::merge_area(0.1) : 1.0;
    };
    // clang-format off
const auto counts_here = mis::verify::one_sample_each(mis::merge_area(radius));
const auto same = mis::verify::throughputs(counts_here, path, n, [&](mis::technique t) { return my_throughput(t); });
    // clang-format on
    CHECK_MESSAGE(same, same.message);
}

TEST_CASE("unit tests: sampling") {
    using vec3 = glm::dvec3;
    pcg32 rng(7);
    std::uniform_real_distribution<double> u01(0, 1);
    const auto u = [&](pcg32& g) { return u01(g); };
    const auto my_lobe_sample = [&](pcg32& g) {
        const double cosine = std::sqrt(u(g)), phi = 2 * double(pi) * u(g),
                     sine = std::sqrt(1 - cosine * cosine);
        return vec3(sine * std::cos(phi), sine * std::sin(phi), cosine);
    };
    const auto my_lobe_density = [](const vec3& w) { return std::max(0.0, w.z) / double(pi); };
    // clang-format off
mis::verify::sampler_options options;
options.support = 2 * pi; // of the hemisphere
const auto lobe = mis::verify::direction_sampler([&] { return std::optional<vec3>(my_lobe_sample(rng)); },
                                                 [&](const vec3& w) { return my_lobe_density(w); }, options);
const auto lens = mis::verify::square_sampler([&] { return std::optional<mis::verify::point>({u(rng), u(rng)}); },
                                              [](mis::verify::point) { return 1.0; });
    // clang-format on
    CHECK_MESSAGE(lobe, lobe.message);
    CHECK_MESSAGE(lens, lens.message);
    std::printf("lens: %s\n", lens.message.c_str()); // what docs/unit_tests.md quotes
    const auto my_image_mean = [&](const char*, int) { return 1 + 0.2 * u(rng); };
    // clang-format off
mis::verify::running_mean path_tracing, bidirectional;
for (int pass = 0; pass < 100; ++pass) {
    mis::verify::add(path_tracing, my_image_mean("path tracing", pass));
    mis::verify::add(bidirectional, my_image_mean("bidirectional", pass));
}
const auto agree = mis::verify::estimates_agree({{"path tracing", 3, path_tracing}, {"all", 3, bidirectional}});
    // clang-format on
    CHECK_MESSAGE(agree, agree.message);
}

TEST_CASE("unit tests: invariances") {
    const auto f = [](const auto& c, const auto* x, int length, mis::technique of) {
        return mis::weight(mis::balance, c, x, length, of);
    };
    const auto my_balance = [](const double* q, int count, int i) {
        return mis::weight(mis::balance, q, count, i);
    };
    const double densities[] = {1, 2, 3};
    const auto all = some_path();
    mis::measured_vertex<double> measured[n];
    for (int i = 0; i < n; ++i) {
        measured[i].kind = all[static_cast<std::size_t>(i)].kind;
        measured[i].dirac = i == 0;
        measured[i].pdf_to_light = measured[i].pdf_to_camera = 0.5;
        measured[i].pdf_position = measured[i].pdf_next_event = 1;
    }
    const auto* const path = measured;
    // clang-format off
const auto scale = mis::verify::scale_invariance(f, counts, path, n);  // a scene 3 times as large
const auto swap = mis::verify::swap_invariance(f, counts, path, n);    // camera and light exchanged
const auto times = mis::verify::count_invariance(f, counts, path, n);  // all counts times 7
const auto split = mis::verify::splitting_invariance(my_balance, densities, 3); // one technique counted as two
    // clang-format on
    CHECK_MESSAGE(scale, scale.message);
    CHECK_MESSAGE(swap, swap.message);
    CHECK_MESSAGE(times, times.message);
    CHECK_MESSAGE(split, split.message);
}

namespace {

struct Vertex {
    const char* kind;
    struct {
        double x, y, z;
    } p, n;
    double pdf_to_light, pdf_to_camera, pdf_position, pdf_next_event, survival, selection;
};
const int pixels = 100;

// clang-format off
void dump(std::FILE* file, const char* technique, int s, double weight, const std::vector<Vertex>& path) {
    std::fprintf(file, R"({"technique":"%s","camera_vertices":%d,"weight":%.9g,"heuristic":"power","beta":2,)", technique, s,
                 weight);
    std::fprintf(file, R"("counts":{"light_hit":1,"next_event":1,"connection":1,"camera_connection":%d},"vertices":[)", pixels);
    for (const Vertex& x : path) // from camera to light
        std::fprintf(file,
                     R"(%s{"kind":"%s","position":[%.9g,%.9g,%.9g],"normal":[%.9g,%.9g,%.9g],"pdf_to_light":%.9g,)"
                     R"("pdf_to_camera":%.9g,"pdf_position":%.9g,"pdf_next_event":%.9g,"survival":%.9g,"selection":%.9g})",
                     &x == path.data() ? "" : ",", x.kind, x.p.x, x.p.y, x.p.z, x.n.x, x.n.y, x.n.z, x.pdf_to_light,
                     x.pdf_to_camera, x.pdf_position, x.pdf_next_event, x.survival, x.selection);
    std::fputs("]}\n", file);
}
// clang-format on

} // namespace

namespace {

// A renderer's own vectors.
struct Vec3 {
    float x = 0, y = 0, z = 0;
};
Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
float dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

template <bool dumps> std::string shadow_of_a_renderer() {
    std::ostringstream file;
    const Vec3 lens{0, 0, 0}, lens_normal{0, 0, 1}, x{0, 0, 2}, x_normal{0, 0, -1}, y{0, 3, 0},
        y_normal{0, -1, 0};
    const auto counts = mis::path_tracing_next_event<float>();
    const mis::end_point<float> camera_end{mis::pdf_position{1.f}, mis::pdf_next_event{1.f},
                                           mis::pdf_direction{100.f}, mis::cosine{1.f}, false};
    const mis::end_point<float> light_end{mis::pdf_position{0.25f}, mis::pdf_next_event{0.5f},
                                          mis::pdf_direction{0.3f}, mis::cosine{1.f}, true};
    const float p = 0.3f, q = 0.2f;
    const double survival = 0.75, weight = 0.5;
    // clang-format off
mis::verify::shadow_walk<Vec3, dumps> camera, light_point; // kept beside the states

camera.start_camera(lens, lens_normal, camera_end);       // beside weigh.start_camera(camera_end)
camera.arrive(mis::vertex_kind::surface, x, x_normal);    // beside weigh.arrive(...)
camera.scatter(mis::pdf_forward{p}, mis::pdf_reverse{q}); // beside weigh.scatter(...), or before a join
camera.note(&mis::recorded_vertex::survival, survival);   // what only tells mistakes apart

light_point.start_light(y, y_normal, light_end); // a next event's light is a walk of one vertex
if (dumps) {
    mis::path_record r = mis::verify::record_of(mis::technique_kind::next_event, counts, camera, light_point, weight);
    r.heuristic = mis::heuristic_kind::power;
    mis::verify::write_json(file, r); // one line of the dump
}
    // clang-format on
    return file.str();
}

} // namespace

TEST_CASE("shadow walks") {
    CHECK(shadow_of_a_renderer<false>().empty());
    const std::string line = shadow_of_a_renderer<true>();
    CHECK(
        line.find(
            R"({"technique":"next_event","camera_vertices":2,"weight":0.5,"heuristic":"power","beta":2,)") ==
        0);
    CHECK(line.find(R"("survival":0.75)") != std::string::npos);
}

TEST_CASE("wrong weights") {
    std::FILE* const file = std::tmpfile();
    dump(file, "next_event", 2, 1, {Vertex{}, Vertex{}, Vertex{}});
    CHECK(std::ftell(file) > 100);
    std::fclose(file);
    struct weighed {
        const mis::area_vertex<double>* vertices;
        int n;
        mis::technique technique;
        double weight;
    };
    const double radius = 0.1;
    const std::vector<weighed> paths(20, {::vertices, ::n, t, 0.5});
    // clang-format off
mis::diagnosis d;
for (const auto& path : paths) {
    mis::path_record record = mis::record_of(counts, path.vertices, path.n, path.technique, path.weight, radius);
    record.heuristic = mis::heuristic_kind::power;
    mis::judge(d, record);
}
for (const mis::suspect& s : mis::suspects_of(d).suspects)
    std::puts(mis::describe(s).c_str());
    // clang-format on
}

TEST_CASE("bidirectional: where every instruction counts") {
    struct {
        mis::subpath_state<float> state{1, 1};
    } x, next;
    const auto counts = mis::bidirectional(100.f);
    const float cos_out = 1, cos_in = 1, p = 1, q = 1, d2 = 4, diameter = 1e5f;
    const mis::end_point<float> light{mis::pdf_position{p}, mis::pdf_next_event{p}, mis::pdf_direction{p},
                                      mis::cosine{cos_in}, true};
    const mis::subpath_end<float> camera_end{x.state, mis::cosine{cos_out}, mis::pdf_forward{p},
                                             mis::pdf_reverse{q}};
    float w = 0;
    {
        // clang-format off
const mis::path_weights weigh{mis::power, counts, mis::connected_surfaces{}};

next.state = weigh.step(x.state, mis::cosine_out{cos_out}, mis::pdf_forward{p}, mis::pdf_reverse{q},
                        mis::squared_distance{d2}, mis::cosine_in{cos_in});

const mis::kept_end kept = mis::keep(light); // once for each light point
w = weigh.next_event(camera_end, kept, mis::squared_distance{d2});
        // clang-format on
        CHECK(w > 0);
        CHECK(next.state.b > 0);
    }
    {
        // clang-format off
const mis::path_weights weigh{mis::power, mis::for_scene_of_size(counts, diameter)};
        // clang-format on
        const auto x =
            weigh.arrive(weigh.start_camera(light), mis::squared_distance{d2}, mis::cosine{cos_in});
        CHECK(weigh.light_hit(x, light) > 0);
    }
}

TEST_CASE("roulette and splitting") {
    float nu = 0.5f;
    const float adjoint = 2, estimate = 0.1f, u = 0.5f, contribution = 1, variance_of_pixel = 0.1f;
    const float rays = 3, rays_per_pixel = 10;
    {
        // clang-format off
const float q = mis::adjoint_rate(nu, adjoint, estimate, mis::window_of_size(5.f));
const int n = mis::copies(q, u); // u uniform in [0, 1)
nu /= q;                         // of each of the n copies
        // clang-format on
        CHECK(n >= 5);
        CHECK(nu * adjoint / estimate == doctest::Approx(10.0 / 6));
        CHECK(mis::adjoint_rate(0.5f, 1, 1) == 0.5f);
    }
    mis::running_statistics<float> cell;
    mis::trimmed_mean<float> pixels;
    // clang-format off
cell.add(contribution, rays);          // of a walk of weight 1 from here on, and what it cost
pixels.add(variance_of_pixel);         // a mis::trimmed_mean<float>, of the image
    // clang-format on
    {
        // clang-format off
const mis::image_estimate<float> image{mis::mean(pixels, 0.05f), rays_per_pixel};
const float q = mis::efficiency_rate(nu, mis::estimate_of(cell), image);
        // clang-format on
        CHECK(q >= 1 / 32.f);
    }
    const mis::path_weights weigh{mis::power, mis::bidirectional(100.f)};
    const mis::cosine cos_out{0.5f}, cos_in{0.5f};
    const mis::squared_distance distance2{4.f};
    const mis::pdf_forward forward{0.3f};
    const mis::pdf_reverse reverse{0.3f};
    const float q = 3, q_other = 1, q_other_at_previous = 1;
    mis::subpath_state<float> state{1, 1};
    // clang-format off
state = weigh.scatter(state, cos_out, mis::with_rate(forward, q), mis::with_rate(reverse, q_other));

state = weigh.arrive(state, distance2, cos_in, mis::with_rate(mis::pdf_distance_forward{1.f}, q),
                     mis::with_rate(mis::pdf_distance_reverse{1.f}, q_other_at_previous));
    // clang-format on
    CHECK(state.b > 0);
}

TEST_CASE("media") {
    const float extinction[] = {1, 2, 3}, first_radius = 0.1f, t = 1;
    const float photons = 1000, beams = 1000, r_2 = 0.1f, r_1 = 0.1f, density_to_here = 0.5f;
    const float density_back_to_here = 0.25f, pass_back_to_here = 0.5f, sin_theta = 1;
    const long long iteration = 3;
    // clang-format off
const float r_3 = mis::progressive_radius(first_radius, iteration, mis::optimal_alpha_in<float>(3), 3);

const mis::distance_density<float> d = mis::distance_in_medium(extinction, 3, t);
// it collides at t with density d.density, and passes t with probability d.pass

    // clang-format on
    CHECK(d.pass < 1);
    auto all = mis::bidirectional(100.f);
    all.merge = 1;
    const mis::path_weights weigh{mis::power, all};
    const mis::subpath_state<float> camera{1, 1}, light{1, 1};
    const mis::pdf_to_light to_light{1.f};
    const mis::pdf_to_camera to_camera{1.f};
    // clang-format off
// once: what one density per volume, area or length stands for; 0 where a family is off
const mis::family_sizes<float> sizes{mis::point_point_size(photons, r_3), mis::point_beam_size(photons, r_2),
                                     mis::beam_point_size(photons, r_2), mis::beam_beam_size(beams, r_1)};

// at a vertex, when both of its segments are known: long beams of the camera, short ones of the light
const mis::family_sizes<float> here = mis::at_vertex(
    sizes, mis::beams<float>{mis::beam(density_to_here), mis::beam(density_back_to_here, pass_back_to_here)}, sin_theta);
const float factor = mis::joined(mis::power, here); // with counts.merge = 1

const float w = weigh.merge(camera, light, to_light, to_camera, factor) *
                mis::family_share(mis::power, here, mis::merge_family::beam_beam);

    // clang-format on
    CHECK(w > 0);
}

TEST_CASE("sequences") {
    const float n_walks = 4, n_steps = 1, densities[] = {0.5f, 0.25f}, emitted = 1;
    const int own = 0;
    float L = 0;
    // clang-format off
const float sequences[] = {n_walks, n_steps}; // how many each method makes
auto state = mis::start_sequence(sequences);

// after each draw, which method `own` has made
state = mis::next_draw(state, densities, own); // of this draw, by each method; survival included
L += mis::term_weight(mis::balance, state, own) * throughput * emitted;
    // clang-format on
    CHECK(L == doctest::Approx(throughput * 8 / 9));
}

TEST_CASE("allocation") {
    const double f[] = {1, 2, 3}, densities[] = {1, 0.5}, pilot_density = 1.5, budget = 12, u = 0.3;
    // clang-format off
mis::pilot<2, 3> pixel; // two techniques, three channels

pixel.add(f, densities, pilot_density); // every pilot sample: f, p of both techniques, and sum n p of the pilot's
pixel.passes += 1;                      // after each pass of the pilot

const double costs[] = {1, 2}; // of a sample of each, in rays, say
const auto found = mis::allocate(pixel, costs, budget);

int samples[2];
mis::round_counts(found.counts, 2, u, samples); // u uniform in [0, 1)
    // clang-format on
    CHECK(found.counts[0] + 2 * found.counts[1] == doctest::Approx(12));
    CHECK(samples[0] + samples[1] >= 6);
    double image = 0;
    const double share = 0.25, later = 1;
    // clang-format off
image = share * mis::integral(pixel)[0] + (1 - share) * later;
    // clang-format on
    CHECK(image == doctest::Approx(0.25 / 1.5 + 0.75));
}
