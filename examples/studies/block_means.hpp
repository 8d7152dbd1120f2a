// Whether images are right on average: means of blocks over independent runs, against those of a reference.
#pragma once

#include "render_parts.hpp"
#include <lab/pictures.hpp>

namespace studies {

struct block_means {
    static constexpr int across = 4;
    static constexpr std::size_t whole = across * across, count = whole + 1; // the last: the whole image
    using blocks = std::array<double, count>;
    std::vector<blocks> runs; // all channels added

    void add(const bpt::image& image) {
        blocks sums{};
        for (std::size_t i = 0; i < image.pixels.size(); ++i) {
            const int x = static_cast<int>(i) % image.width, y = static_cast<int>(i) / image.width;
            const glm::dvec3& c = image.pixels[i];
            const int block = y * across / image.width * across + x * across / image.width;
            sums[static_cast<std::size_t>(block)] += c.x + c.y + c.z;
            sums[whole] += c.x + c.y + c.z;
        }
        runs.push_back(sums);
    }
    // The mean of a block over runs, and its variance.
    std::array<double, 2> mean_and_variance(std::size_t block) const {
        const double n = static_cast<double>(runs.size());
        double mean = 0, squares = 0;
        for (const blocks& run : runs)
            mean += run[block] / n;
        for (const blocks& run : runs)
            squares += (run[block] - mean) * (run[block] - mean);
        return {mean, squares / (n * (n - 1))};
    }
};

// The largest difference of any block, or of the whole images, over its standard error.
inline double largest_difference(const block_means& a, const block_means& b) {
    double largest = 0;
    for (std::size_t block = 0; block < block_means::count; ++block) {
        const auto [mean_a, variance_a] = a.mean_and_variance(block);
        const auto [mean_b, variance_b] = b.mean_and_variance(block);
        const double deviation = std::sqrt(variance_a + variance_b);
        largest = std::max(largest, deviation > 0 ? std::abs(mean_a - mean_b) / deviation : 0);
    }
    return largest;
}

// The probability that Student's t is further than this from 0 by chance.
inline double chance_of_t(double t, double degrees) {
    const double scale = std::exp(std::lgamma((degrees + 1) / 2) - std::lgamma(degrees / 2)) /
                         std::sqrt(degrees * std::acos(-1.0));
    constexpr int steps = 4000; // midpoints of x = t + s / (1 - s)
    double tail = 0;
    for (int k = 0; k < steps; ++k) {
        const double s = (k + 0.5) / steps, x = t + s / (1 - s);
        tail += scale * std::pow(1 + x * x / degrees, -(degrees + 1) / 2) / ((1 - s) * (1 - s)) / steps;
    }
    return std::min(1.0, 2 * tail);
}

// Prints whether all blocks of some estimates are the reference's. A false alarm for 1 seed of 1000, were the
// means of runs normal.
inline bool check_blocks(const std::vector<block_means>& estimates, const block_means& reference) {
    constexpr double false_alarms = 1e-3;
    double largest = 0;
    std::size_t least_runs = reference.runs.size();
    for (const block_means& e : estimates) {
        largest = std::max(largest, largest_difference(e, reference));
        least_runs = std::min(least_runs, e.runs.size());
    }
    const double tests = static_cast<double>(estimates.size() * block_means::count);
    const double chance = chance_of_t(largest, static_cast<double>(least_runs - 1));
    return report(chance * tests >= false_alarms,
                  text("means of %d x %d blocks and of images are the reference's, by all estimates: at most "
                       "%.1f standard "
                       "errors apart, chance %.2g (bar: %.2g, false alarms for 1 seed of %.0f)",
                       block_means::across, block_means::across, largest, chance, false_alarms / tests,
                       1 / false_alarms));
}

// A reference whose images tell how sure it is.
struct sampled_reference : reference {
    block_means blocks;
};

// From images of renderers with seeds of their own: make(image) makes them.
template <class Make>
sampled_reference render_sampled_reference(const std::string& name, double seconds, int shortest,
                                           Make&& make) {
    constexpr std::size_t images = 16;
    sampled_reference r;
    std::vector<bpt::image> all;
    for (std::size_t k = 0; k < images; ++k) {
        const auto renderer = make(k);
        parts sum(renderer.set.width);
        sum.shortest = shortest;
        const double start = processor_seconds();
        do {
            show_progress(text("%s: reference, image %zu of %zu", name.c_str(), k + 1, images));
            add_pass(renderer, sum);
        } while (processor_seconds() - start < seconds / images);
        all.push_back(mean_image(sum));
        r.blocks.add(all.back());
    }
    r.mean = bpt::black(all[0].width);
    for (std::size_t i = 0; i < r.mean.pixels.size(); ++i) {
        glm::dvec3& mean = r.mean.pixels[i];
        for (const auto& image : all)
            mean += image.pixels[i] / static_cast<double>(images);
        for (const auto& image : all) {
            const glm::dvec3 apart = image.pixels[i] - mean;
            r.noise +=
                dot(apart, apart) / static_cast<double>(images * (images - 1) * 3 * r.mean.pixels.size());
        }
    }
    return r;
}

// Of repeated runs: the mean of their errors, and how sure it is.
struct mean_error {
    std::vector<double> squared; // mean squared error of each run

    double mean() const {
        double sum = 0;
        for (const double x : squared)
            sum += x;
        return sum / static_cast<double>(squared.size());
    }
    double standard_error() const {
        double squares = 0;
        for (const double x : squared)
            squares += (x - mean()) * (x - mean());
        const double n = static_cast<double>(squared.size());
        return std::sqrt(squares / (n * (n - 1)));
    }
};
// mean over another's, and its standard error, both runs being independent.
inline std::array<double, 2> ratio(const mean_error& a, const mean_error& b) {
    const double r = a.mean() / b.mean();
    return {r, r * std::hypot(a.standard_error() / a.mean(), b.standard_error() / b.mean())};
}

// Several estimates of one image, by as many runs each.
class repeated_estimates {
public:
    std::vector<mean_error> errors;

    repeated_estimates(const sampled_reference& r, std::size_t count)
        : errors(count), expected(r), blocks(count) {}

    // A run's image by estimate e: run after run, in each one estimate after the other.
    void add(std::size_t e, const bpt::image& image) {
        errors[e].squared.push_back(mean_squared_error(image, 1, expected));
        blocks[e].add(image);
        if (first.size() < errors.size())
            first.push_back(image);
    }
    // The reference, and the images of the first run.
    void write_sheet(const std::string& file, const char* const* names, double exposure, int columns) const {
        std::vector<lab::labelled_image> sheet{{"reference", expected.mean, exposure}};
        for (std::size_t e = 0; e < first.size(); ++e)
            sheet.push_back({names[e], first[e], exposure});
        lab::write_sheet(file, sheet, columns);
    }
    bool check() const { return check_blocks(blocks, expected.blocks); }

private:
    const sampled_reference& expected;
    std::vector<block_means> blocks;
    std::vector<bpt::image> first;
};

} // namespace studies
