// Misuse that must not compile, one a line; MISUSE is the line's number. misuse.cmake compiles each and looks
// for the message beside it, and the rest, which is right, without any.
#include <mis/mis.hpp>
#include <mis/optimal/estimator.hpp>

int main() {
    const int pixels = 1024;
    const float p = 1, q = 2, d = 3;
    const mis::path_weights weigh{mis::power, mis::bidirectional(float(pixels))};
    const auto tracing = mis::path_tracing(), next_event = mis::path_tracing_next_event();
    mis::subpath_state<float> state;
    state = weigh.arrive(state, mis::squared_distance{d * d}, mis::cosine{p});
    state = weigh.scatter(state, mis::cosine{p}, mis::pdf_forward{p}, mis::pdf_reverse{q});
    const mis::subpath_end<float> end{state, mis::cosine{p}, mis::pdf_forward{p}, mis::pdf_reverse{q}};
    state = weigh.step(state, mis::cosine_out{p}, mis::pdf_forward{p}, mis::pdf_reverse{q},
                       mis::squared_distance{d * d}, mis::cosine_in{p});
    float w =
        weigh.connection(end, end, mis::squared_distance{d * d}) + tracing.light_hit + next_event.next_event;

// A case's message stands on its line.
// clang-format off
#define CASE(number) (MISUSE == number)
#if CASE(1) // real numbers: write mis::bidirectional(float(pixels))
    w += float(mis::bidirectional(pixels).connection);
#elif CASE(2) // real numbers: write float(pixels), 3.f, not 3
    w += mis::power(1, 3);
#elif CASE(3) // real numbers: write float(pixels), 3.f, not 3
    const int densities[] = {1, 2, 3};
    w += mis::weight(mis::balance, densities, 0);
#elif CASE(4) // the cutoff heuristic needs all densities at once: weigh complete paths, mis::weight()
    const mis::path_weights complete{mis::cutoff, mis::bidirectional(float(pixels))};
    w += complete.counts.connection;
#elif CASE(5) // pdf_reverse<float>.*pdf_forward<float>
    state = weigh.scatter(state, mis::cosine{p}, mis::pdf_reverse{q}, mis::pdf_forward{p});
#elif CASE(6) // pdf_reverse<float>.*pdf_forward<float>
    const mis::subpath_end<float> exchanged{state, mis::cosine{p}, mis::pdf_reverse{q}, mis::pdf_forward{p}};
    w += weigh.connection(exchanged, end, mis::squared_distance{d * d});
#elif CASE(7) // float.*squared_distance<float>
    w += weigh.connection(end, end, d);
#elif CASE(8) // float.*cosine<float>
    const mis::subpath_end<float> bare{state, p, p, q};
    w += weigh.connection(bare, end, mis::squared_distance{d * d});
#elif CASE(9) // pdf_next_event<float>.*pdf_position<float>
    const mis::end_point<float> light{mis::pdf_next_event{p}, mis::pdf_position{q}, mis::pdf_direction{p},
                                      mis::cosine{p}, true};
    w += weigh.light_hit(state, light);
#elif CASE(10) // pdf_to_camera<float>.*pdf_to_light<float>
    w += weigh.merge(state, state, mis::pdf_to_camera{p}, mis::pdf_to_light{q});
#elif CASE(11) // cosine<float>.*squared_distance<float>
    state = weigh.arrive(state, mis::cosine{p}, mis::squared_distance{d * d});
#elif CASE(12) // real numbers: write float(pixels), 3.f, not 3
    const int counts[] = {1, 1}, throughputs[] = {1, 2};
    int out[2];
    mis::densities_from_throughputs(counts, throughputs, 2, out);
#elif CASE(13) // pdf_forward<double>.*pdf_forward<float>
    state = weigh.scatter(state, mis::cosine{p}, mis::pdf_forward{1.0}, mis::pdf_reverse{q});
#elif CASE(14) // real numbers: write float(pixels), 3.f, not 3
    const int f = 3;
    float out[2];
    const float numbers[] = {1, 2};
    mis::optimal::weights(numbers, f, numbers, numbers, 2, out);
#elif CASE(15) // real numbers: write estimator<M, Channels, float>
    mis::optimal::estimator<2, 3, int> sums;
    w += float(sums.size());
#elif CASE(16) // no techniques
    mis::optimal::estimator<0> sums;
    w += float(sums.size());
#elif CASE(17) // cosine_in<float>.*cosine_out<float>
    state = weigh.step(state, mis::cosine_in{p}, mis::pdf_forward{p}, mis::pdf_reverse{q},
                       mis::squared_distance{d}, mis::cosine_out{p});
#elif CASE(18) // this scalar has no limits: specialize std::numeric_limits for it
    struct unlimited { float x; };
    w += mis::detail::saturate(unlimited{1}).x;
#elif CASE(19) // the cutoff heuristic needs all densities at once: weigh complete paths, mis::weight()
    const mis::path_weights complete{mis::cutoff, mis::bidirectional(float(pixels)), mis::connected_surfaces{}};
    w += complete.counts.connection;
#endif
    // clang-format on
    return w > 0 ? 0 : 1;
}
