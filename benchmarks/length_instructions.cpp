// The weight of one connection of paths of more and more vertices, in four ways, so that valgrind can count
// their instructions: by two numbers per vertex, by three, by a loop over both walks, by the products of all
// densities. benchmarks/count_lengths.sh prints the table. The four are first checked to agree; 1 if they do
// not.
#include "inputs.hpp"
#include <cstdio>

namespace {

constexpr int repetitions = 100;

template <class T>
const mis::path_weights two_numbers{mis::balance, mis::bidirectional(T(1)), mis::connected_surfaces{}};
template <class T> const alternatives::three_number_weights<1, T> three_numbers{0, 0, 1};

// One walk along a path, up to the vertex that is connected, as each of the schemes keeps it.
template <class T> struct walk {
    mis::subpath_end<T> two;
    typename alternatives::three_number_weights<1, T>::end three;
    std::vector<alternatives::loop_vertex<T>> vertices;
};

template <class T> using recorded_path = std::vector<mis::measured_vertex<T>>;

template <class T> walk<T> walk_to(const recorded_path<T>& path, bool from_camera, int last) {
    const auto at = [&](int i) -> const mis::measured_vertex<T>& {
        return path[static_cast<std::size_t>(i)];
    };
    const int step = from_camera ? 1 : -1, first = from_camera ? 0 : static_cast<int>(path.size()) - 1;
    const auto forward = [&](int i) { return from_camera ? at(i).pdf_to_light : at(i).pdf_to_camera; };
    const auto reverse = [&](int i) { return from_camera ? at(i).pdf_to_camera : at(i).pdf_to_light; };
    const auto cos_out = [&](int i) { return from_camera ? at(i).cos_to_light : at(i).cos_to_camera; };
    const auto cos_in = [&](int i) { return from_camera ? at(i).cos_to_camera : at(i).cos_to_light; };
    const auto distance2 = [&](int i) { return at(from_camera ? i - 1 : i).distance2_to_light; };

    const mis::end_point<T> end{
        mis::pdf_position<T>(at(first).pdf_position), mis::pdf_next_event<T>(at(first).pdf_next_event),
        mis::pdf_direction<T>(forward(first)), mis::cosine<T>(cos_out(first)), !from_camera};
    auto two = from_camera ? two_numbers<T>.start_camera(end) : two_numbers<T>.start_light(end);
    // Nothing hits a pinhole.
    const T hit = from_camera ? 0 : cos_out(first) / (forward(first) * at(first).pdf_position);
    alternatives::three_numbers<T> three{1 / forward(first), hit, 0};
    std::vector<alternatives::loop_vertex<T>> vertices;
    T density = at(first).pdf_position;
    for (int i = first;; i += step) {
        const int next = i + step;
        const T back = i == last ? 0 : reverse(next) * cos_out(i) / distance2(next);
        vertices.push_back({density, back, cos_out(i), i == first ? T(1) : distance2(i),
                            at(i).kind == mis::vertex_kind::dirac});
        if (i == last)
            break;
        density = forward(i) * cos_in(next) / distance2(next);
        if (i != first) {
            two = two_numbers<T>.scatter(two, mis::cosine<T>(cos_out(i)), mis::pdf_forward<T>(forward(i)),
                                         mis::pdf_reverse<T>(reverse(i)));
            three = three_numbers<T>.scatter(three, cos_out(i), forward(i), reverse(i));
        }
        two = two_numbers<T>.arrive(two, mis::squared_distance<T>(distance2(next)),
                                    mis::cosine<T>(cos_in(next)));
        three = three_numbers<T>.arrive(three, distance2(next), cos_in(next));
    }
    return {{two, mis::cosine<T>(cos_out(last)), mis::pdf_forward<T>(forward(last)),
             mis::pdf_reverse<T>(reverse(last))},
            {three, cos_out(last), forward(last), reverse(last)},
            vertices};
}

// A path of n vertices, connected in its middle.
template <class T> struct connected_path {
    walk<T> camera, light;
    std::vector<T> from_light, from_camera; // densities per area, from the light on
    T distance2;
};

template <class T> connected_path<T> connect(int n) {
    recorded_path<T> path(static_cast<std::size_t>(n));
    const auto in_float = inputs::path(n);
    for (std::size_t i = 0; i < path.size(); ++i) {
        const mis::measured_vertex<float>& x = in_float[i];
        mis::measured_vertex<T>& y = path[i];
        y.kind = x.kind;
        y.dirac = x.dirac;
        y.pdf_to_light = T(x.pdf_to_light);
        y.pdf_to_camera = T(x.pdf_to_camera);
        y.cos_to_camera = T(x.cos_to_camera);
        y.cos_to_light = T(x.cos_to_light);
        y.distance2_to_light = T(x.distance2_to_light);
        y.pdf_position = y.pdf_next_event = T(x.pdf_position); // the same, as the loop has it
    }
    const int s = n / 2;
    connected_path<T> p{walk_to(path, true, s - 1),
                        walk_to(path, false, s),
                        {},
                        {},
                        path[static_cast<std::size_t>(s) - 1].distance2_to_light};
    for (int i = n - 1; i >= 0; --i) {
        const mis::area_vertex<T> x = mis::area_densities(path.data(), n, i);
        p.from_light.push_back(i == n - 1 ? path.back().pdf_position : x.density_from_light);
        p.from_camera.push_back(i == 0 ? 1 : x.density_from_camera);
    }
    return p;
}

// What is counted, by name.
template <int N, class T> NOT_INLINED T by_two_numbers(const connected_path<T>& p) {
    return two_numbers<T>.connection(p.camera.two, p.light.two, mis::squared_distance<T>(p.distance2));
}
template <int N, class T> NOT_INLINED T by_three_numbers(const connected_path<T>& p) {
    return three_numbers<T>.connection(p.camera.three, p.light.three, p.distance2);
}
template <int N, class T> NOT_INLINED T by_loop(const connected_path<T>& p) {
    return alternatives::loop_connection(p.camera.vertices.data(), static_cast<int>(p.camera.vertices.size()),
                                         p.light.vertices.data(), static_cast<int>(p.light.vertices.size()),
                                         p.camera.three, p.light.three, p.distance2);
}
template <int N, class T> NOT_INLINED T by_products(const connected_path<T>& p) {
    return alternatives::product_connection(p.from_light.data(), p.from_camera.data(), N, N - N / 2);
}

template <int N, class T> bool weigh() {
    const connected_path<T> p = connect<T>(N);
    T sums[4] = {};
    for (int i = 0; i < repetitions; ++i) {
        sums[0] += by_two_numbers<N>(p);
        sums[1] += by_three_numbers<N>(p);
        sums[2] += by_loop<N>(p);
        sums[3] += by_products<N>(p);
    }
    bool same = sums[0] > 0 && sums[0] < repetitions;
    for (T sum : sums)
        same = same && std::abs(sum / sums[0] - 1) < T(1e-4);
    if (!same)
        std::printf("%d vertices, weights: %g %g %g %g\n", N, double(sums[0]), double(sums[1]),
                    double(sums[2]), double(sums[3]));
    return same;
}

} // namespace

int main() {
    const bool same[] = {weigh<4, float>(),  weigh<8, float>(),  weigh<16, float>(),  weigh<32, float>(),
                         weigh<4, double>(), weigh<8, double>(), weigh<16, double>(), weigh<32, double>()};
    for (const bool one : same)
        if (!one)
            return 1;
}
