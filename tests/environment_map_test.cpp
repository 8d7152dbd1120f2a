// SPDX-License-Identifier: MIT
// The environments of the studies: files are read as they are or refused in one line, and samplers follow
// their densities. A right sampler fails with probability 1e-6; seeds are fixed.
#include <ImfChannelList.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <ImfRgbaFile.h>
#include <doctest/doctest.h>
#include <fstream>
#include <mis/verify.hpp>
#include <studies/environment_map.hpp>

namespace {

using namespace studies::direct_light;

constexpr int height = 4, width = 8;
using colors = std::vector<std::array<float, 3>>;

colors some_colors() {
    colors all;
    for (int i = 0; i < width * height; ++i)
        all.push_back({float(i), 0.5f, float(i % 3)});
    return all;
}

void write_exr(const std::string& file, int w, int h, const colors& all) {
    std::vector<Imf::Rgba> pixels;
    for (const auto& c : all)
        pixels.emplace_back(c[0], c[1], c[2]);
    Imf::RgbaOutputFile out(file.c_str(), w, h, Imf::WRITE_RGB);
    out.setFrameBuffer(pixels.data(), 1, std::size_t(w));
    out.writePixels(h);
}

void write_text(const std::string& file, const std::string& bytes) {
    std::ofstream(file, std::ios::binary) << bytes;
}
std::string bytes_of(const std::string& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

// What is said of a file that cannot be used: one line with its name.
std::string refusal(const std::string& file) {
    try {
        read_environment(file);
    } catch (const std::runtime_error& error) {
        const std::string what = error.what();
        CHECK(what.find('\n') == std::string::npos);
        CHECK(what.find("'" + file + "' ") == 0);
        return what;
    }
    return "";
}
bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

environment_map some_map() {
    pcg32 rng(1);
    return make_map(8, [&](const dvec3&) {
        const double u = uniform(rng);
        return dvec3(u < 0.3 ? 0 : std::exp(3 * u), 0.2 * u, u < 0.9 ? 0 : 20);
    });
}

// Where a direction lies in the map: rows and columns, linear in y within a row.
mis::verify::point to_square(const environment_map& m, const dvec3& d) {
    const auto pixel = m.pixel_of(d);
    const double row = double(pixel / std::size_t(m.width()));
    const double top = std::cos(pi * row / m.height), bottom = std::cos(pi * (row + 1) / m.height);
    return {(row + (top - d.y) / (top - bottom)) / m.height, std::atan2(d.z, d.x) / (2 * pi) + 0.5};
}

} // namespace

TEST_CASE("OpenEXR files, the first row at the zenith") {
    const colors all = some_colors();
    write_exr("environment.exr", width, height, all);
    const environment_map m = read_environment("environment.exr");
    REQUIRE(m.height == height);
    for (std::size_t i = 0; i < all.size(); ++i)
        for (std::size_t c = 0; c < 3; ++c)
            CHECK(m.pixels[i][int(c)] == all[i][c]);
}

TEST_CASE("Radiance files") {
    const std::string heading = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n";
    // Mantissas A, B, C and the exponent ~ (126): (mantissa + 1/2) / 256 * 2^(126 - 128), with or without the
    // half.
    write_text("environment.hdr", heading + "-Y 1 +X 2\nABC~CBA~");
    const environment_map m = read_environment("environment.hdr");
    REQUIRE(m.height == 1);
    for (int c = 0; c < 3; ++c) {
        CHECK(m.pixels[0][c] == doctest::Approx(('A' + c) / 1024.0).epsilon(0.01));
        CHECK(m.pixels[1][c] == doctest::Approx(('C' - c) / 1024.0).epsilon(0.01));
    }
    // Runs: row 1 has eight pixels, of four channels each.
    const std::string row{'\x02', '\x02', 0, 8, '\x88', 'A', 4, 'A', 'B', 'C', 'D', '\x84', 'E', '\x88', 'B'};
    std::string whole = heading + "-Y 4 +X 8\n";
    for (int k = 0; k < 4; ++k)
        whole += row + "\x88~";
    write_text("environment.hdr", whole);
    const environment_map packed = read_environment("environment.hdr");
    for (std::size_t i = 0; i < packed.pixels.size(); ++i) {
        const dvec3 expected = (dvec3('A', std::min('A' + int(i % 8), int('E')), 'B') + 0.5) / 1024.0;
        CHECK(length(packed.pixels[i] - expected) < 1e-6);
    }
    for (std::size_t length = 0; length < whole.size(); ++length) {
        CAPTURE(length);
        write_text("environment.hdr", whole.substr(0, length));
        CHECK(!refusal("environment.hdr").empty());
    }
}

TEST_CASE("what is no environment is refused in one line") {
    CHECK(has(refusal("no_such_file.exr"), "No such file"));
    CHECK(has(refusal("."), "is no file"));
    write_text("environment.txt", "P6\n2 1\n255\nabcdef");
    CHECK(has(refusal("environment.txt"), "neither an OpenEXR nor a Radiance HDR file"));
    write_text("environment.exr", "");
    CHECK(has(refusal("environment.exr"), "neither"));

    const colors all = some_colors();
    write_exr("environment.exr", height, width, all);
    CHECK(has(refusal("environment.exr"), "4 x 8 pixels"));
    write_exr("environment.exr", width, height, all);
    const std::string whole = bytes_of("environment.exr");
    for (std::size_t length = 0; length < whole.size(); length += length < whole.size() - 20 ? 7 : 1) {
        CAPTURE(length);
        write_text("environment.exr", whole.substr(0, length));
        CHECK(!refusal("environment.exr").empty());
    }
    for (const float bad :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), -1.0f}) {
        colors spoilt = all;
        spoilt[2 * width + 5][1] = bad;
        write_exr("environment.exr", width, height, spoilt);
        CHECK(has(refusal("environment.exr"), "column 5, row 2"));
    }
    write_exr("environment.exr", width, height, colors(all.size()));
    CHECK(has(refusal("environment.exr"), "is black"));
}

TEST_CASE("a file that claims more pixels than can be read, and has none") {
    for (const auto& claimed : {std::pair(46341, 46341), std::pair(1 << 16, 1 << 12)}) {
        const int columns = claimed.first, rows = claimed.second;
        Imf::Header header(columns, rows);
        for (const char* name : {"R", "G", "B"})
            header.channels().insert(name, Imf::Channel(Imf::FLOAT));
        { const Imf::OutputFile unfinished("environment.exr", header); }
        CHECK(has(refusal("environment.exr"), "more than 134217728 pixels"));
        const std::string size = std::to_string(columns) + " x " + std::to_string(rows) + " pixels";
        CHECK_THROWS_WITH_AS(tools::read_exr("environment.exr"), doctest::Contains(size.c_str()),
                             std::runtime_error);
    }
}

TEST_CASE("directions lie in their pixels, and pixels fill the sphere") {
    const environment_map m = some_map();
    pcg32 rng(2);
    double sphere = 0;
    for (std::size_t i = 0; i < m.pixels.size(); ++i) {
        sphere += m.solid_angle(i);
        for (int k = 0; k < 10; ++k) {
            const double u = uniform(rng), v = uniform(rng);
            CHECK(m.pixel_of(m.direction(i, u, v)) == i);
        }
    }
    CHECK(sphere == doctest::Approx(4 * pi).epsilon(1e-12));
}

TEST_CASE("plain and compensated densities: their formulas, and samplers that follow them") {
    const environment_map m = some_map();
    const environment_density plain = plain_density(m), compensated = compensated_density(m);
    double mean = 0, above = 0;
    for (std::size_t i = 0; i < m.pixels.size(); ++i)
        mean += (m.pixels[i].x + m.pixels[i].y + m.pixels[i].z) / 3 * m.solid_angle(i) / (4 * pi);
    for (std::size_t i = 0; i < m.pixels.size(); ++i)
        above += std::max(0.0, (m.pixels[i].x + m.pixels[i].y + m.pixels[i].z) / 3 - mean) * m.solid_angle(i);
    for (std::size_t i = 0; i < m.pixels.size(); ++i) {
        const double radiance = (m.pixels[i].x + m.pixels[i].y + m.pixels[i].z) / 3;
        CHECK(plain(i) == doctest::Approx(radiance / (4 * pi * mean)).epsilon(1e-12));
        CHECK(std::abs(compensated(i) - std::max(0.0, radiance - mean) / above) < 1e-7 / (4 * pi));
    }
    for (const auto* const density : {&plain, &compensated}) {
        pcg32 rng(3);
        int wrong_pixels = 0;
        mis::verify::sampler_options options;
        options.samples = 400'000;
        options.visible_error = 0.03;
        const auto r = mis::verify::square_sampler(
            [&] {
                std::size_t pixel = 0;
                const dvec3 d = density->sample(rng, pixel);
                wrong_pixels += m.pixel_of(d) != pixel;
                return to_square(m, d);
            },
            [&](mis::verify::point at) {
                const auto row = std::size_t(std::min(at.x * m.height, m.height - 1.0)),
                           column = std::size_t(std::min(at.y * m.width(), m.width() - 1.0));
                const std::size_t pixel = row * std::size_t(m.width()) + column;
                return (*density)(pixel)*m.solid_angle(pixel) * m.height * m.width();
            },
            options);
        CHECK_MESSAGE(r, r.message);
        CHECK(wrong_pixels == 0);
    }
}

TEST_CASE("where all is alike, compensation leaves the density as it is") {
    const environment_map m = make_map(4, [](const dvec3&) { return dvec3(0.1); });
    const environment_density compensated = compensated_density(m);
    for (std::size_t i = 0; i < m.pixels.size(); ++i)
        CHECK(compensated(i) == doctest::Approx(1 / (4 * pi)).epsilon(1e-9));
}

TEST_CASE("reflectors") {
    pcg32 rng(4);
    for (const double roughness : {0.0, 0.2, 0.5, 1.0})
        for (const dvec3& from : {normalize(dvec3(0.3, 0.1, 1)), normalize(dvec3(1, 0, 0.2))}) {
            CAPTURE(roughness);
            const reflector surface{1, roughness};
            mis::verify::sampler_options options;
            options.samples = 400'000;
            options.visible_error = 0.03;
            const auto r = mis::verify::direction_sampler(
                [&]() -> std::optional<dvec3> {
                    const dvec3 to = sample_bsdf(surface, from, rng);
                    return to.z > 0 ? std::optional(to) : std::nullopt;
                },
                [&](const dvec3& to) { return bsdf_density(surface, from, to); }, options);
            CHECK_MESSAGE(r, r.message);
        }
}
