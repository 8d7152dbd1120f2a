// Study: acceptance probabilities as multipliers. A Metropolis chain over pairs of walks, that exchanges one
// of them or both; its states counted as they are, or weighted with the acceptance of each proposal; and
// combined with independent pairs, with weights that are told what the chain multiplies throughputs with, and
// with weights that are not, [J] 4. All from the same pairs, beside as many independent ones. Writes
// metropolis.csv and a picture for each scene. docs/multipliers.md tells what they show.
#include "block_means.hpp"
#include "exchange_chain.hpp"

namespace {

using namespace studies;
using real = float;

struct options : compared_options {
    int passes = 24;
    chain_options chain;
    options() { size = 48, scenes = {"doorway", "cornell"}, runs = 8, reference_seconds = 16; }
};

constexpr int shortest = 3; // vertices: light that is seen directly is left out

constexpr std::size_t independent = chain_estimates;
constexpr std::array<const char*, chain_estimates + 1> names{"states counted",         "by acceptance",
                                                             "with new pairs, untold", "with new pairs, told",
                                                             "told acceptance, too",   "independent pairs"};
// What each is to be compared with: the same without the multiplier.
constexpr std::array<std::size_t, chain_estimates + 1> without{
    counted, counted, combined_unaware, combined_unaware, combined_unaware, independent};

bool report_scene(const std::string& name, const options& o, csv_file& csv) {
    const auto scene = bpt::make_scene<real>(name);
    const mis::balance_heuristic balance;
    const auto renderer_of = [&](std::uint64_t seed) {
        return bpt::renderer<real>(scene, bidirectional_settings<real>(o, seed), balance);
    };
    const auto r = render_sampled_reference(name, o.reference_seconds, shortest,
                                            [&](std::size_t k) { return renderer_of(o.seed + 1000 + k); });
    repeated_estimates all(r, names.size());
    exchange_counts exchanges;
    for (int run = 0; run < o.runs; ++run) {
        show_progress(text("%s: run %d of %d", name.c_str(), run + 1, o.runs));
        const std::uint64_t seed = o.seed + static_cast<std::uint64_t>(run);
        const auto renderer = renderer_of(seed);
        parts alone(o.size);
        alone.shortest = shortest;
        while (alone.passes < o.passes)
            add_pass(renderer, alone);
        const auto images = exchange_chain(renderer, o.chain, shortest).run(o.passes, seed);
        for (std::size_t k = 0; k < 3; ++k) {
            exchanges.proposed[k] += images.exchanges.proposed[k];
            exchanges.accepted[k] += images.exchanges.accepted[k];
        }
        for (std::size_t e = 0; e < names.size(); ++e)
            all.add(e, e == independent ? mean_image(alone) : images.images[e]);
    }
    show_progress("");
    std::printf("%s: %d runs of %d passes; accepted: %.2f of exchanged camera walks, %.2f of light walks, "
                "%.2f of both; the reference's RMS error is %.3g\n",
                name.c_str(), o.runs, o.passes, exchanges.accepted[0] / exchanges.proposed[0],
                exchanges.accepted[1] / exchanges.proposed[1], exchanges.accepted[2] / exchanges.proposed[2],
                std::sqrt(r.noise));
    const auto& errors = all.errors;
    for (std::size_t e = 0; e < names.size(); ++e) {
        const auto over = ratio(errors[e], errors[without[e]]),
                   over_independent = ratio(errors[e], errors[independent]);
        std::printf("  %-22s MSE %9.3g +- %7.2g   that of independent pairs times %.3f +- %.3f, without the "
                    "multiplier %.3f\n",
                    names[e], errors[e].mean(), errors[e].standard_error(), over_independent[0],
                    over_independent[1], over[0]);
        csv.add(text("%s,\"%s\",%d,%d,%g,%g,%g,%g,%g,%g,%g", name.c_str(), names[e], o.runs, o.passes,
                     static_cast<double>(o.seed), errors[e].mean(), errors[e].standard_error(),
                     std::sqrt(errors[e].mean()), over_independent[0], over_independent[1], over[0]));
    }
    all.write_sheet(o.output + "/metropolis-" + name + ".png", names.data(),
                    static_cast<double>(scene.exposure), 4);
    return all.check();
}

bool run(const options& o) {
    return report_scenes(
        o,
        csv_file(
            o.output, "metropolis.csv",
            "scene,estimate,runs,passes,seed,mse,standard_error,rms_error,over_independent,standard_error_"
            "of_ratio,over_without_multiplier"),
        report_scene);
}

} // namespace

int main(int count, char** arguments) {
    options o;
    command_line app("A Metropolis chain over pairs of walks, weighted with its acceptance; writes "
                     "metropolis.csv and pictures.",
                     o);
    add_compared(app, o, bpt::all_scene_names());
    app.add("--runs", o.runs, "images of each estimate", 2, 100000);
    app.add("--passes", o.passes, "steps of the chains, and independent pairs, per pixel", 1, 1 << 20);
    app.add("--chains", o.chain.chains, "of an image", 1, 4096);
    app.add("--both", o.chain.both, "probability of exchanging both walks", 1e-3, 1);
    return run_study(app, o, count, arguments, run);
}
