// Checkpoints of a render, of which no byte may be wrong and unnoticed; and passes in parts for several
// ranks.
#include <cstdio>
#include <cstring>
#include <doctest/doctest.h>
#include <filesystem>
#include <fstream>
#include <lab/checkpoint.hpp>
#include <lab/share.hpp>
#include <limits>
#include <pcg_random.hpp>
#include <random>
#include <sstream>

namespace {

using namespace lab;

const std::string file = "lab_checkpoint_test.checkpoint";
const std::string made_with = "mis 1.2.3\n--seed 1\n--size 4\n";

std::string bytes_of(const std::string& name) {
    std::ifstream in(name, std::ios::binary);
    std::ostringstream all;
    all << in.rdbuf();
    return all.str();
}
void write_bytes(const std::string& bytes) { std::ofstream(file, std::ios::binary) << bytes; }

// What reading is refused with; empty where it is not.
std::string refusal(const std::vector<row_array>& sums, const std::string& of = made_with, int most = 100) {
    try {
        read_checkpoint(file, of, most, sums);
        return {};
    } catch (const std::runtime_error& error) {
        return error.what();
    }
}

// Numbers of all kinds, an array of zeros, and one of 0 and -0.
struct some_sums {
    std::vector<double> image, zeros, minus_zeros;
    std::vector<float> weights;

    explicit some_sums(std::uint64_t seed) : image(24), zeros(12), minus_zeros(4), weights(6) {
        pcg32 rng(seed);
        for (auto& x : image) {
            const std::uint64_t bits = std::uint64_t(rng()) << 32 | rng();
            std::memcpy(&x, &bits, sizeof x);
        }
        image[3] = std::numeric_limits<double>::infinity();
        image[5] = std::numeric_limits<double>::quiet_NaN();
        minus_zeros[2] = -0.0;
        for (auto& x : weights)
            x = std::uniform_real_distribution<float>()(rng);
    }
    std::vector<row_array> arrays() {
        return {rows_of("image", image, 4, 1), rows_of("zeros", zeros, 4, 2),
                rows_of("minus zeros", minus_zeros, 4, 1), rows_of("weights", weights, 2, 1)};
    }
    bool operator==(some_sums& other) {
        const auto own = arrays(), others = other.arrays();
        bool same = true;
        for (std::size_t i = 0; i < own.size(); ++i)
            same &= std::memcmp(own[i].data, others[i].data, own[i].size()) == 0;
        return same;
    }
};

} // namespace

TEST_CASE("what a checkpoint keeps comes back to the last bit") {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        some_sums written(seed), read(seed + 100);
        read.zeros.assign(read.zeros.size(), 7);
        CHECK_FALSE(read == written);
        const int passes = static_cast<int>(seed) * 1000;
        write_checkpoint(file, made_with, passes, written.arrays());
        CHECK(read_checkpoint(file, made_with, passes, read.arrays()) == passes);
        CHECK(read == written);
        CHECK_FALSE(std::filesystem::exists(file + ".new"));
    }
    std::filesystem::remove(file);
}

TEST_CASE("a damaged checkpoint is refused, wherever the damage is") {
    some_sums written(1), read(2);
    write_checkpoint(file, made_with, 12, written.arrays());
    const std::string good = bytes_of(file);
    REQUIRE(good.size() > 200);
    pcg32 rng(3);
    for (std::size_t i = 0; i < good.size(); ++i) {
        std::string bad = good;
        bad[i] = static_cast<char>(bad[i] ^ std::uniform_int_distribution<int>(1, 255)(rng));
        write_bytes(bad);
        const std::string why = refusal(read.arrays());
        CAPTURE(i);
        CHECK(why.find("'" + file + "'") == 0);
        CHECK(why.find('\n') == std::string::npos);
    }
    for (std::size_t size = 0; size < good.size(); ++size) {
        write_bytes(good.substr(0, size));
        const std::string why = refusal(read.arrays());
        CHECK_MESSAGE(why.find("is cut off after " + std::to_string(size) + " bytes") != std::string::npos,
                      why);
    }
    write_bytes(good + '\0');
    CHECK(refusal(read.arrays()).find("is damaged from byte " + std::to_string(good.size())) !=
          std::string::npos);
    std::string bad = good;
    bad[good.size() - 1] ^= 1;
    write_bytes(bad);
    CHECK(refusal(read.arrays()) ==
          "'" + file + "' is damaged from byte " + std::to_string(good.size() - 16 - 24) + " on: weights");
    std::filesystem::remove(file);
}

TEST_CASE("a checkpoint of something else is refused") {
    some_sums sums(1);
    std::filesystem::remove(file);
    some_sums as_before(1);
    CHECK(read_checkpoint(file, made_with, 100, sums.arrays()) == 0); // none
    CHECK(sums == as_before);

    write_checkpoint(file, made_with, 12, sums.arrays());
    CHECK(refusal(sums.arrays()).empty());
    CHECK(refusal(sums.arrays(), made_with, 12).empty());
    CHECK(refusal(sums.arrays(), made_with, 11) == "'" + file + "' has 12 passes, more than --samples 11");
    CHECK(refusal(sums.arrays(), "mis 1.2.3\n--seed 2\n--size 4\n") ==
          "'" + file + "' is of --seed 1, not --seed 2");
    CHECK(refusal(sums.arrays(), made_with + "--mistake merge_area\n") ==
          "'" + file + "' is of other options");
    CHECK(refusal(sums.arrays(), "mis 1.2.3\n--seed 1\n") == "'" + file + "' is of other options");
    std::filesystem::remove(file);

    std::filesystem::create_directory(file);
    CHECK(refusal(sums.arrays()) == "'" + file + "' cannot be read");
    std::filesystem::remove(file);
}

TEST_CASE("a pass in parts for ranks is the pass") {
    lab::settings<float> set;
    set.width = 12;
    set.threads = 2;
    set.passes = 1;
    set.counts = mis::bidirectional(144.0f);
    set.balance_all = true;
    set.dump_paths = 2;
    pass_result<float> made;
    render(make_scene<float>("cornell"), set, [&](const pass_result<float>& pass) { made = pass; });
    // Bytes of what a pixel gets, in its order.
    const auto of_pixel = [](const pass_result<float>& pass, int pixel) {
        std::string contributions, samples;
        for (const auto& row : pass.rows) {
            for (const auto& c : row.contributions)
                if (c.pixel == pixel)
                    append(contributions, &c, 1);
            for (const auto& s : row.samples)
                if (s.pixel == pixel)
                    append(samples, &s, 1);
        }
        return contributions + samples;
    };
    const auto lines_of = [](const pass_result<float>& pass) {
        std::string lines;
        for (const auto& row : pass.rows)
            for (const auto& line : row.dump)
                lines += line + "\n";
        return lines;
    };
    const auto paths_of = [](const pass_result<float>& pass) {
        std::int64_t paths = 0;
        for (const auto& row : pass.rows)
            paths += row.checks.paths;
        return paths;
    };
    REQUIRE(paths_of(made) > 500);
    for (const int rows_of_tile : {1, 3, 5, 12})
        for (const int count : {1, 2, 3, 7, 20}) {
            const auto parts = split(made, set.width, rows_of_tile, count);
            REQUIRE(parts.size() == static_cast<std::size_t>(count));
            for (int rank = 0; rank < count; ++rank) {
                const auto part = joined<float>(0, parts[static_cast<std::size_t>(rank)]);
                int differ = 0;
                for (int pixel = 0; pixel < 144; ++pixel) {
                    const bool is_own = pixel / 12 / rows_of_tile % count == rank;
                    differ += of_pixel(part, pixel) != (is_own ? of_pixel(made, pixel) : "");
                }
                CHECK(differ == 0);
                CHECK(paths_of(part) == (rank == 0 ? paths_of(made) : 0));
                CHECK(lines_of(part) == (rank == 0 ? lines_of(made) : ""));
            }
        }
}
