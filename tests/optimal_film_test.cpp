// SPDX-License-Identifier: MIT
#include <cstdlib>
#include <cstring>
#include <doctest/doctest.h>
#include <mis/optimal/film.hpp>
#include <pcg_random.hpp>
#include <random>
#include <sstream>
#include <type_traits>

// Allocations are looked at: the largest, and those above a size fail.
static std::size_t largest_allocation = 0, fails_above = ~std::size_t(0);

static void* allocate(std::size_t size, std::size_t alignment) {
    largest_allocation = size > largest_allocation ? size : largest_allocation;
    const std::size_t whole = (size + alignment - 1) / alignment * alignment;
#ifdef _WIN32
    void* const p = size > fails_above ? nullptr : _aligned_malloc(whole, alignment);
#else
    void* const p = size > fails_above ? nullptr : std::aligned_alloc(alignment, whole);
#endif
    if (p == nullptr)
        throw std::bad_alloc();
    return p;
}
static void release(void* p) {
#ifdef _WIN32
    _aligned_free(p);
#else
    std::free(p);
#endif
}
void* operator new(std::size_t size) { return allocate(size, alignof(std::max_align_t)); }
void* operator new(std::size_t size, std::align_val_t a) { return allocate(size, std::size_t(a)); }
void operator delete(void* p) noexcept { release(p); }
void operator delete(void* p, std::size_t) noexcept { release(p); }
void operator delete(void* p, std::align_val_t) noexcept { release(p); }
void operator delete(void* p, std::size_t, std::align_val_t) noexcept { release(p); }

namespace {

// A stream of letters without an end.
struct endless : std::streambuf {
    std::size_t given = 0;
    char letter = 'x';

    int underflow() override {
        if (++given > 1'000'000) // for a reader that would not stop
            return traits_type::eof();
        setg(&letter, &letter, &letter + 1);
        return letter;
    }
};

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
    CHECK(mis::optimal::merge(one, splats).empty());
    CHECK(mis::optimal::merge(one, tile, 3, 1).empty());
    CHECK(mis::optimal::merge(other, tile, 3, 1).empty());
    CHECK(mis::optimal::merge(other, splats).empty());
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
    for (std::size_t length = start; length < bytes.size(); ++length)
        CHECK(refused(bytes.substr(0, length)) == "the film is cut off");
    std::string text = bytes; // as a stream of text writes lines on Windows
    text.insert(start - 1, 1, '\r');
    CHECK(refused(text) == "a film from a stream that std::ios::binary has not opened");
    std::string swapped = bytes;
    std::swap(swapped[start], swapped[start + 3]);
    CHECK(refused(swapped) == "a film of another byte order");
    const auto with_size = [&](std::int32_t width, std::int32_t height) {
        std::string sized = bytes;
        std::memcpy(&sized[start + 4], &width, sizeof width);
        std::memcpy(&sized[start + 8], &height, sizeof height);
        return sized;
    };
    CHECK(refused(with_size(0x7f000003, 0x7f000002)) == "a film of impossible size");
    CHECK(refused(with_size(-3, 2)) == "a film of impossible size");
    for (const double wrong :
         {std::numeric_limits<double>::quiet_NaN(), -1.0, std::numeric_limits<double>::infinity()}) {
        std::string counted = bytes;
        std::memcpy(&counted[start + 12 + sizeof wrong], &wrong, sizeof wrong);
        CHECK(refused(counted) == "a film whose counts are no numbers of samples");
    }
}

TEST_CASE("load takes memory for what is there, not for what the heading says") {
    // 2^14 x 2^14 pixels, the most there may be, and none of them: 64 GB.
    const std::string bytes = saved(film(0, 0, counts));
    const std::size_t start = bytes.find('\n') + 1;
    std::string promises = bytes;
    const std::int32_t size[] = {1 << 14, 1 << 14};
    std::memcpy(&promises[start + 4], &size[0], sizeof size);
    film loaded;
    largest_allocation = 0;
    CHECK(load(promises, loaded) == "the film is cut off");
    CHECK(largest_allocation < 10'000);
    // a pixel is 17 numbers; of 100 of them, at most twice as many are made room for
    promises += std::string(100 * 17 * 8, '\0');
    CHECK(load(promises, loaded) == "the film is cut off");
    CHECK(largest_allocation < 3 * 100 * sizeof(film::estimator_type));
    // a first line without an end
    endless endless_line;
    std::istream in(&endless_line);
    largest_allocation = 0;
    const std::string reason = mis::optimal::load(in, loaded);
    CHECK(reason.find("no film of this type: 'xxxx") == 0);
    CHECK(reason.size() < 300);
    CHECK(endless_line.given < 10'000);
    CHECK(largest_allocation < 10'000);
    // memory that is not there
    std::istringstream limited(promises, std::ios::binary);
    fails_above = 10'000;
    const std::string failure = mis::optimal::load(limited, loaded);
    fails_above = ~std::size_t(0);
    CHECK(failure == "a film too large for the memory");
    // no bytes of the stream that would need more than one line, or tell a terminal what to do
    CHECK(load("\x1b[2J\r!\n", loaded).find("no film of this type: '?[2J?!'") == 0);
}

TEST_CASE("films that do not fit are not merged, and say so") {
    film to = random_film(5, 4, 3);
    const film before = to, tile = random_film(2, 3, 5);
    film counted = random_film(5, 4, 3), broken = random_film(5, 4, 3);
    counted.counts[1] = 3;
    broken.height = 5;
    const auto refused = [&](const film& other, int x = 0, int y = 0) {
        const std::string reason = merge(to, other, x, y);
        CHECK(are_same(to, before));
        return reason;
    };
    CHECK(refused(tile, 4, 1) == "a tile of 2 x 3 at (4, 1) is not within a film of 5 x 4");
    CHECK(refused(tile, 3, 2) == "a tile of 2 x 3 at (3, 2) is not within a film of 5 x 4");
    CHECK(refused(tile, -1, 0) == "a tile of 2 x 3 at (-1, 0) is not within a film of 5 x 4");
    CHECK_FALSE(refused(tile, 2'147'483'647, 0).empty());
    CHECK(refused(random_film(6, 4, 1)) == "a tile of 6 x 4 at (0, 0) is not within a film of 5 x 4");
    CHECK(refused(counted) == "films of different counts");
    CHECK(refused(broken) == "a film of 5 x 5 with 20 pixels");
    CHECK(merge(to, film(0, 0, counts), 5, 4).empty());
    CHECK(are_same(to, before));
    std::ostringstream out;
    mis::optimal::save(out, broken);
    CHECK(out.fail());
    CHECK(out.str().empty());
}
