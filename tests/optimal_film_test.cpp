// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>
#include <mis/optimal/film.hpp>
#include <pcg_random.hpp>
#include <random>
#include <sstream>
#include <type_traits>

namespace {

using film = mis::optimal::film<3, 2>;

constexpr std::array<double, 3> counts{1, 2, 5};

double uniform(pcg32& rng) { return std::uniform_real_distribution<double>(0, 1)(rng); }

// A sample of some pixel, and a draw that left the domain.
void add_random(film& f, int x, int y, pcg32& rng) {
    const double densities[] = {uniform(rng), 2 * uniform(rng), 5 * uniform(rng)},
                 value[] = {uniform(rng), uniform(rng) - 0.5};
    f.at(x, y).add(value, densities);
    f.at(x, y).add_outside(1);
}
film random_film(int width, int height, std::uint64_t seed) {
    film f(width, height, counts);
    pcg32 rng(seed);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int k = 0; k < 20; ++k)
                add_random(f, x, y, rng);
    return f;
}

bool are_same(const film& a, const film& b) {
    const auto x = mis::optimal::integrals(a, 1), y = mis::optimal::integrals(b, 1);
    return a.width == b.width && a.height == b.height && a.counts == b.counts && x == y;
}

std::string saved(const film& f) {
    std::ostringstream out(std::ios::binary);
    mis::optimal::save(out, f);
    CHECK(out.good());
    return out.str();
}
std::string load(const std::string& bytes, film& f) {
    std::istringstream in(bytes, std::ios::binary);
    return mis::optimal::load(in, f);
}

} // namespace

TEST_CASE("estimators lie in one block, and pixels are theirs alone") {
    static_assert(std::is_trivially_copyable_v<film::estimator_type>);
    film f = random_film(4, 3, 1);
    CHECK(f.pixels.size() == 12);
    CHECK(&f.at(1, 2) == &f.pixels[9]);
    const auto before = mis::optimal::integrals(f);
    pcg32 rng(2);
    add_random(f, 1, 2, rng);
    const auto after = mis::optimal::integrals(f);
    for (std::size_t i = 0; i < 12; ++i) {
        CHECK((before[i] != after[i]) == (i == 9));
        CHECK(after[i] == mis::optimal::integral(f.pixels[i], counts));
    }
}

TEST_CASE("tiles and splats are merged in any order") {
    // Whole films, as threads have them, and tiles that overlap.
    film one = random_film(5, 4, 3), other = one;
    const film splats = random_film(5, 4, 4), tile = random_film(2, 3, 5);
    mis::optimal::merge(one, splats);
    mis::optimal::merge(one, tile, 3, 1);
    mis::optimal::merge(other, tile, 3, 1);
    mis::optimal::merge(other, splats);
    const auto a = mis::optimal::integrals(one), b = mis::optimal::integrals(other);
    for (std::size_t i = 0; i < a.size(); ++i)
        for (std::size_t c = 0; c < 2; ++c)
            CHECK(std::abs(a[i][c] - b[i][c]) <= 1e-12 * std::abs(a[i][c]));
    auto expected = random_film(5, 4, 3).at(4, 3);
    expected += splats.at(4, 3);
    expected += tile.at(1, 2);
    CHECK(mis::optimal::integral(one.at(4, 3), counts) == mis::optimal::integral(expected, counts));
}

TEST_CASE("any number of threads gives the same image") {
    const film f = random_film(37, 11, 6);
    const auto alone = mis::optimal::integrals(f, 1);
    for (const int threads : {0, 2, 3, 16})
        CHECK(mis::optimal::integrals(f, threads) == alone);
    CHECK(mis::optimal::integrals(film(), 4).empty());
}

TEST_CASE("a film that is saved and resumed ends as one that was not") {
    film f = random_film(6, 5, 7);
    film resumed;
    CHECK(load(saved(f), resumed).empty());
    CHECK(are_same(f, resumed));
    pcg32 rng(8), same(8);
    for (int k = 0; k < 100; ++k) {
        add_random(f, k % 6, k % 5, rng);
        add_random(resumed, k % 6, k % 5, same);
    }
    CHECK(are_same(f, resumed));
    CHECK(saved(f) == saved(resumed));
}

TEST_CASE("what is no saved film is refused, and the film stays as it was") {
    const film f = random_film(3, 2, 9);
    const std::string bytes = saved(f);
    const std::size_t start = bytes.find('\n') + 1;
    const auto refused = [&](std::string damaged) {
        film loaded = random_film(2, 2, 10);
        const std::string reason = load(damaged, loaded);
        CHECK(are_same(loaded, random_film(2, 2, 10)));
        return reason;
    };
    CHECK(refused("").find("no film of this type") == 0);
    CHECK(refused("P6 128 128 255\n").find("'P6 128 128 255'") != std::string::npos);
    std::ostringstream other;
    mis::optimal::save(other, mis::optimal::film<4, 2>(3, 2, {}));
    CHECK(refused(other.str()).find("techniques 4") != std::string::npos);
    for (std::size_t length : {start, start + 11, start + 12, bytes.size() - 1})
        CHECK_FALSE(refused(bytes.substr(0, length)).empty());
    std::string swapped = bytes;
    std::swap(swapped[start], swapped[start + 3]);
    CHECK(refused(swapped) == "a film of another byte order");
    std::string large = bytes;
    large[start + 7] = large[start + 11] = 0x7f;
    CHECK(refused(large) == "a film of impossible size");
}
