// SPDX-License-Identifier: MIT
// Calls every function of the core on the device, in float and double, so that nvcc compiles each of them.
// Compiled only; the numbers mean nothing.
#include <mis/batch.hpp>
#include <mis/media.hpp>
#include <mis/mis.hpp>
#include <mis/roulette.hpp>
#include <mis/sequence.hpp>
#include <mis/verify/subpaths.hpp>

namespace {

struct vec {
    float x, y, z;
};
__host__ __device__ vec operator-(vec a, vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
__host__ __device__ float dot(vec a, vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

template <class T, class Heuristic> __device__ T any_number(const Heuristic& h, T* q, int n) {
    T array[4] = {q[0], q[1], q[2], q[3]};
    T sum = h(q[0], q[1]) + mis::weight_of_first(h, q[1], q[2]);
    sum += mis::weight(h, q, n, 1) + mis::weight(h, array, 2);
    mis::weights(h, q, n, q);
    mis::weights(h, array, array);
    mis::weights_of_sample<2>(h, q, 4, n, q);
    return sum + array[0];
}

template <class T> __device__ T measures(const T* q) {
    const mis::per_area<T> area = mis::to_area(mis::per_solid_angle<T>{q[0]}, q[1], q[2]);
    const mis::per_solid_angle<T> angle = mis::to_solid_angle(area, q[1], q[2]);
    const mis::per_volume<T> volume = mis::to_volume(angle, q[1], q[2]);
    return area.value + angle.value + volume.value + mis::dirac_density(q[0], q[1], q[2]) +
           mis::shading_normal_factor(q[0], q[1], q[2], q[3]);
}

template <class T> __device__ T techniques(const T* q, int n) {
    const mis::technique t = mis::technique_at(n, n / 2);
    T sum = T(mis::technique_index(n, t)) + T(mis::technique_count(n)) + (t == t ? T(1) : T(0)) +
            (t != t ? T(1) : T(0));
    for (const auto& c : {mis::path_tracing<T>(), mis::path_tracing_next_event<T>(), mis::light_tracing(q[0]),
                          mis::bidirectional(q[0]), mis::photon_mapping(q[0], q[1]),
                          mis::connection_and_merging(q[0], q[1])}) {
        sum += mis::count_of(c, t.kind) + mis::count_of(c, n, t) + mis::merge_area(q[1]);
        sum += mis::times_merge_area(c, q[1]).merge + mis::divided_by_merge_area(c, q[1]).merge;
        sum += mis::random_connection(mis::scaled(c, q[2]), q[3]).connection;
    }
    return sum;
}

template <class T> __device__ T biases(T* q, int n) {
    mis::bias_aware_densities(q, q + n, q + n, n, q);
    return mis::bias_aware_density(q[0], q[1], q[2]) + mis::balance_gap_bound(q[0], q[1], q[2]) +
           mis::next_squared_radius(q[0], n) + mis::progressive_radius(q[0], n) +
           mis::progressive_radius(q[0], n, mis::optimal_alpha<T>);
}

template <class T> __device__ T media(T* q) {
    const mis::family_sizes<T> sizes{mis::point_point_size(q[0], q[1]), mis::point_beam_size(q[0], q[1]),
                                     mis::beam_point_size(q[0], q[1]), mis::beam_beam_size(q[0], q[1], q[2])};
    const auto here = mis::at_vertex(sizes, mis::beams<T>{mis::beam(q[0]), mis::beam(q[1], q[2])}, q[3]);
    const mis::distance_density<T> d = mis::distance_in_medium(q, 3, q[3]);
    return mis::joined(mis::balance_heuristic{}, here) + mis::joined(mis::power_heuristic<>{}, here) +
           mis::joined(mis::power_heuristic<T>{q[0]}, here) + mis::joined(mis::maximum_heuristic{}, here) +
           mis::family_share(mis::power_heuristic<>{}, here, mis::merge_family::beam_beam) + d.density +
           d.pass + mis::size_of(here, mis::merge_family::point_beam) +
           mis::progressive_radius(q[0], 3, mis::optimal_alpha_in<T>(3), 3);
}

template <class T> __device__ T sequences(const T* q) {
    const T counts[] = {q[0], q[1]}, densities[] = {q[2], q[3]};
    const auto x = mis::next_draw(mis::start_sequence(counts), densities, 1);
    const auto single = mis::put_in_front(mis::end_sequence<T, 2>(q[0]), q[1], q[2], densities);
    return mis::term_weight(mis::power_heuristic<>{}, x, 1) + mis::single_weight(single, counts, 0);
}

template <class T> __device__ T roulette(T* q, int n) {
    const mis::weight_window<T> window = mis::window_of_size(q[0]);
    mis::running_statistics<T> statistics, others;
    statistics.add(q[0], q[1], q[2]);
    statistics += others;
    mis::trimmed_mean<T> mean, other_means;
    mean.add(q[0], q[1]);
    mean += other_means;
    const mis::image_estimate<T> image{mis::mean(mean, q[2]), q[1]};
    const mis::walk_estimate<T> here = mis::estimate_of(mis::scaled(statistics, q[3]));
    T p[4];
    const auto adjoint = [&](int i) { return q[i]; };
    T sum = mis::zero_variance_probabilities(q, adjoint, 4, p, q[1]) + T(mis::pick(p, 4, q[0]));
    sum += mis::adjoint_rate(q[0], q[1], q[2], window) + T(mis::copies(q[0], q[1])) +
           mis::efficiency_rate(q[0], here, image) + mis::technique_rate(q[0], q[1], q[2], image);
    sum += mis::zero_variance_density(q[0], q[1], q[2]) + mis::zero_variance_survival(q[0], q[1]);
    return sum + T(n) * mis::with_rate(mis::pdf_forward<T>(q[0]), q[1]).value;
}

template <class T, class Heuristic, class Vertex>
__noinline__ __device__ T complete_path(const Heuristic& h, const mis::technique_counts<T>& counts,
                                        const Vertex* path, int n, T* out) {
    mis::relative_densities(counts, path, n, out);
    mis::weights(h, counts, path, n, out);
    return mis::weight(h, counts, path, n, mis::technique_at(n, 1));
}

template <class T, class Heuristic>
__noinline__ __device__ T subpaths(const Heuristic& h, const mis::technique_counts<T>& counts,
                                   const mis::measured_vertex<T>* path, int n, const T* q) {
    const mis::path_weights<Heuristic, T> weigh(h, counts);
    const mis::cosine c{q[0]};
    const mis::pdf_forward forward{q[4]};
    const mis::pdf_reverse reverse{q[5]};
    const mis::squared_distance d2{q[6]};
    const mis::end_point<T> end{mis::pdf_position{q[0]}, mis::pdf_next_event{q[1]}, mis::pdf_direction{q[2]},
                                c, true};
    auto a = weigh.arrive(weigh.start_camera(end), d2, c);
    auto b = weigh.arrive_from_infinity(weigh.start_light(end), c);
    const T hits = weigh.light_hit(weigh.arrive_at_infinity(a), end) + weigh.camera_hit(b, end);
    a = weigh.arrive(weigh.scatter(a, c, forward, reverse), d2, c, mis::pdf_distance_forward{q[1]},
                     mis::pdf_distance_reverse{q[2]});
    b = weigh.arrive(weigh.scatter(b, c, forward, reverse, q[3]), d2, c);
    a = weigh.arrive(weigh.scatter_dirac(a, c, forward, reverse, mis::eta_in{q[3]}, mis::eta_out{q[4]}), d2,
                     c);
    a = weigh.step(a, mis::cosine_out{q[0]}, forward, reverse, d2, mis::cosine_in{q[1]});
    const mis::subpath_end<T> camera{a, c, forward, reverse}, light{b, c, forward, reverse};
    const mis::path_weights<Heuristic, T, mis::connected_surfaces> known(
        h, mis::for_scene_of_size(counts, q[0]));
    const mis::kept_end<T> kept = mis::keep(end);
    const mis::pdf_to_light to_light{q[4]};
    const mis::pdf_to_camera to_camera{q[5]};
    return hits + known.connection(camera, light, d2) + known.next_event(camera, kept, d2) +
           known.camera_connection(mis::pdf_direction{q[2]}, light, d2) + known.light_hit(a, kept) +
           weigh.connection(camera, light, d2) + weigh.next_event(camera, end, d2) +
           weigh.camera_connection(end, light, d2) + weigh.direct(end, end, d2) +
           weigh.merge(a, b, to_light, to_camera) + weigh.merge(a, b, to_light, to_camera, q[3]) +
           mis::weight_in_subpaths(h, counts, path, n, mis::technique_at(n, 1));
}

template <class T> __device__ T core(T* q, int n) {
    const mis::average_heuristic average{};
    const mis::balance_heuristic balance{};
    const mis::power_heuristic power{};
    const mis::power_heuristic power_of_3{3};
    const mis::cutoff_heuristic cutoff{};
    const mis::maximum_heuristic maximum{};
    T sum = any_number(average, q, n) + any_number(balance, q, n) + any_number(power, q, n) +
            any_number(power_of_3, q, n) + any_number(cutoff, q, n) + any_number(maximum, q, n);
    sum += mis::power(q[0], q[1]) + mis::balance(q[0], q[1]) + mis::maximum(q[0], q[1]) +
           mis::average(q[0], q[1]) + mis::cutoff(q[0], q[1]);
    sum += measures(q) + techniques(q, n) + biases(q, n) + roulette(q, n) + media(q) + sequences(q);

    sum += mis::density_from_throughput(q[0], q[1]);
    mis::densities_from_throughputs(q, q + n, n, q);

    mis::measured_vertex<T> measured[3];
    mis::area_vertex<T> areas[3];
    for (int i = 0; i < 3; ++i) {
        measured[i].pdf_to_light = measured[i].pdf_to_camera = q[i];
        measured[i] = mis::measure(measured, 3, i);
        areas[i] = mis::area_densities(measured, 3, i);
    }
    const mis::technique_counts<T> counts = mis::bidirectional(q[0]);
    return sum + complete_path(balance, counts, measured, n, q) + complete_path(power, counts, areas, n, q) +
           subpaths(balance, counts, measured, n, q);
}

__device__ float positions(float* q) {
    mis::path_vertex<vec> path[3];
    for (int i = 0; i < 3; ++i) {
        path[i].position = {q[i], q[i + 1], q[i + 2]};
        path[i].normal = {0, 0, 1};
    }
    path[2].kind = mis::vertex_kind::infinite_light;
    const auto counts = mis::bidirectional(q[0]);
    const mis::measured_vertex<float> measured[] = {mis::measure(path, 3, 0), mis::measure(path, 3, 1),
                                                    mis::measure(path, 3, 2)};
    q[0] += subpaths(mis::power_heuristic{}, counts, measured, 3, q) +
            subpaths(mis::maximum_heuristic{}, counts, measured, 3, q) +
            subpaths(mis::average_heuristic{}, counts, measured, 3, q);
    return mis::measure(path, 3, 1).cos_to_light + mis::area_densities(path, 3, 1).density_from_camera +
           complete_path(mis::balance_heuristic{}, counts, path, 3, q);
}

} // namespace

__global__ void every_function(float* f, double* d, int n) {
    f[0] = core(f, n) + positions(f);
    d[0] = core(d, n);
}
