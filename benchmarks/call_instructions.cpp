// Each call of a renderer's loops a thousand times, so that valgrind can count its instructions:
//     call_instructions SCHEME        (no argument: prints all schemes)
// benchmarks/count_calls.sh runs all of them and prints the table. Calls are not inlined, and what they are
// given lies in memory; the two ends of a path differ, so that no work is shared between them.
#include "inputs.hpp"
#include <cstdio>
#include <cstring>

namespace {

constexpr int repetitions = 1000;

// mis, with the same names as the three numbers of alternatives.hpp.
template <class Heuristic, class Use, class T> struct two_number_weights {
    using number = T;
    using state = mis::subpath_state<T>;
    using end = mis::subpath_end<T>;
    using light = mis::end_point<T>;
    mis::path_weights<Heuristic, T, Use> weigh{{}, mis::connection_and_merging(T(1000), T(0.01))};

    static state make_state(T a, T b, T) { return {a, b}; }
    static end make_end(state x, T cos, T forward, T reverse) {
        return {x, mis::cosine{cos}, mis::pdf_forward{forward}, mis::pdf_reverse{reverse}};
    }
    static light make_light(T position, T next_event, T direction, T cos, bool hittable) {
        return {mis::pdf_position{position}, mis::pdf_next_event{next_event}, mis::pdf_direction{direction},
                mis::cosine{cos}, hittable};
    }
    state arrive(state x, T distance2, T cos_in) const {
        return weigh.arrive(x, mis::squared_distance{distance2}, mis::cosine{cos_in});
    }
    state scatter(state x, T cos_out, T forward, T reverse) const {
        return weigh.scatter(x, mis::cosine{cos_out}, mis::pdf_forward{forward}, mis::pdf_reverse{reverse});
    }
    state step(state x, T cos_out, T forward, T reverse, T distance2, T cos_in) const {
        return weigh.step(x, mis::cosine_out{cos_out}, mis::pdf_forward{forward}, mis::pdf_reverse{reverse},
                          mis::squared_distance{distance2}, mis::cosine_in{cos_in});
    }
    state scatter_dirac(state x, T cos_in, T forward, T reverse) const {
        return weigh.scatter_dirac(x, mis::cosine{cos_in}, mis::pdf_forward{forward},
                                   mis::pdf_reverse{reverse});
    }
    T connection(const end& camera, const end& l, T distance2) const {
        return weigh.connection(camera, l, mis::squared_distance{distance2});
    }
    T next_event(const end& camera, const light& l, T distance2) const {
        return weigh.next_event(camera, l, mis::squared_distance{distance2});
    }
    T camera_connection(const light& lens, const end& l, T distance2) const {
        return weigh.camera_connection(lens, l, mis::squared_distance{distance2});
    }
    T light_hit(state x, const light& l) const { return weigh.light_hit(x, l); }
    // what is ready at a light whose record is kept, and at a pinhole
    using kept = mis::kept_end<T>;
    static kept make_kept(const light& l) { return mis::keep(l); }
    T next_event(const end& camera, const kept& l, T distance2) const {
        return weigh.next_event(camera, l, mis::squared_distance{distance2});
    }
    T pinhole(T direction, const end& l, T distance2) const {
        return weigh.camera_connection(mis::pdf_direction{direction}, l, mis::squared_distance{distance2});
    }
    T light_hit(state x, const kept& l) const { return weigh.light_hit(x, l); }
    T merge(state camera, state l, T to_light, T to_camera) const {
        return weigh.merge(camera, l, mis::pdf_to_light{to_light}, mis::pdf_to_camera{to_camera});
    }
};

template <int Power, class T> struct three : alternatives::three_number_weights<Power, T> {
    using number = T;
    using base = alternatives::three_number_weights<Power, T>;
    using typename base::end, typename base::state;
    using light = typename base::end_point;
    three() : base{T(0.7), 1 / T(0.7), 1000} {}

    static state make_state(T a, T b, T c) { return {a, b, c}; }
    static end make_end(state x, T cos, T forward, T reverse) { return {x, cos, forward, reverse}; }
    static light make_light(T position, T next_event, T direction, T cos, bool hittable) {
        return {position, next_event, direction, cos, hittable};
    }
    // what it has no call of its own for
    using kept = light;
    static kept make_kept(const light& l) { return l; }
    T pinhole(T direction, const end& l, T distance2) const {
        return this->camera_connection({1, 1, direction, 1, false}, l, distance2);
    }
    state step(state x, T cos_out, T forward, T reverse, T distance2, T cos_in) const {
        return this->arrive(this->scatter(x, cos_out, forward, reverse), distance2, cos_in);
    }
    state scatter_dirac(state x, T cos_out, T, T) const { return base::scatter_dirac(x, cos_out); }
};

template <class Scheme> struct vertex {
    typename Scheme::state state;
    typename Scheme::number distance2, cos_in, cos_out, forward, reverse;
};

// The functions whose instructions are counted, by name.
template <class W> using number = typename W::number;
template <class W> NOT_INLINED void upkeep(const W& w, typename W::state& s, vertex<W>& v) {
    v.state = w.arrive(s, v.distance2, v.cos_in);
    s = w.scatter(v.state, v.cos_out, v.forward, v.reverse);
}
template <class W> NOT_INLINED void step(const W& w, const vertex<W>& v, vertex<W>& next) {
    next.state = w.step(v.state, v.cos_out, v.forward, v.reverse, next.distance2, next.cos_in);
}
template <class W> NOT_INLINED void dirac(const W& w, typename W::state& s, const vertex<W>& v) {
    s = w.scatter_dirac(s, v.cos_in, v.forward, v.reverse);
}
template <class W>
NOT_INLINED number<W> connection(const W& w, const typename W::end& c, const typename W::end& l,
                                 number<W> d2) {
    return w.connection(c, l, d2);
}
template <class W>
NOT_INLINED number<W> next_event(const W& w, const typename W::end& c, const typename W::light& l,
                                 number<W> d2) {
    return w.next_event(c, l, d2);
}
template <class W>
NOT_INLINED number<W> camera_connection(const W& w, const typename W::light& c, const typename W::end& l,
                                        number<W> d2) {
    return w.camera_connection(c, l, d2);
}
template <class W>
NOT_INLINED number<W> light_hit(const W& w, const typename W::state& s, const typename W::light& l) {
    return w.light_hit(s, l);
}
template <class W>
NOT_INLINED number<W> kept_next_event(const W& w, const typename W::end& c, const typename W::kept& l,
                                      number<W> d2) {
    return w.next_event(c, l, d2);
}
template <class W>
NOT_INLINED number<W> pinhole(const W& w, number<W> direction, const typename W::end& l, number<W> d2) {
    return w.pinhole(direction, l, d2);
}
template <class W>
NOT_INLINED number<W> kept_light_hit(const W& w, const typename W::state& s, const typename W::kept& l) {
    return w.light_hit(s, l);
}
template <class W>
NOT_INLINED number<W> merge(const W& w, const typename W::state& c, const typename W::state& l, number<W> a,
                            number<W> b) {
    return w.merge(c, l, a, b);
}

template <class W> double run() {
    const W w;
    pcg32 rng(2);
    const auto random = [&] { return number<W>(inputs::positive(rng)); };
    std::vector<vertex<W>> vertices;
    for (int i = 0; i <= repetitions; ++i)
        vertices.push_back({W::make_state(random(), random(), random()), random(), random() / 2, random() / 2,
                            random(), random()});
    number<W> sum = 0;
    for (std::size_t i = 0; i < repetitions; ++i) {
        vertex<W>&x = vertices[i], &y = vertices[i + 1];
        const auto c = W::make_end(x.state, x.cos_out, x.forward, x.reverse);
        const auto l = W::make_end(y.state, y.cos_in, y.reverse, y.forward);
        const auto lamp = W::make_light(x.forward, y.forward, y.reverse, x.cos_in, true);
        const auto lens = W::make_light(1, 1, y.reverse, x.cos_in, false);
        sum += connection(w, c, l, x.distance2) + next_event(w, c, lamp, x.distance2) +
               camera_connection(w, lens, l, x.distance2) + light_hit(w, x.state, lamp) +
               merge(w, x.state, y.state, x.forward, x.reverse) +
               kept_next_event(w, c, W::make_kept(lamp), x.distance2) +
               pinhole(w, y.reverse, l, x.distance2) + kept_light_hit(w, x.state, W::make_kept(lamp));
        typename W::state s = y.state;
        dirac(w, s, x);
        upkeep(w, s, x);
        step(w, x, y);
    }
    return static_cast<double>(sum);
}

} // namespace

int main(int count, char** arguments) {
    using mis::any_techniques, mis::balance_heuristic, mis::connected_surfaces, mis::power_heuristic;
    struct {
        const char* name;
        double (*run)();
    } const schemes[] = {
        {"three_balance", run<three<1, float>>},
        {"any_balance", run<two_number_weights<balance_heuristic, any_techniques, float>>},
        {"known_balance", run<two_number_weights<balance_heuristic, connected_surfaces, float>>},
        {"three_power", run<three<2, float>>},
        {"any_power", run<two_number_weights<power_heuristic<>, any_techniques, float>>},
        {"known_power", run<two_number_weights<power_heuristic<>, connected_surfaces, float>>},
        {"three_balance_double", run<three<1, double>>},
        {"any_balance_double", run<two_number_weights<balance_heuristic, any_techniques, double>>},
        {"known_balance_double", run<two_number_weights<balance_heuristic, connected_surfaces, double>>},
    };
    for (const auto& scheme : schemes) {
        if (count < 2)
            std::puts(scheme.name);
        else if (std::strcmp(arguments[1], scheme.name) == 0)
            return std::printf("%g\n", scheme.run()) < 0;
    }
    return count < 2 ? 0 : 2;
}
