// SPDX-License-Identifier: MIT
// Floor 4: an image of estimators: one for each pixel, or for each tile of pixels. Needs Eigen.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <istream>
#include <mis/optimal/solve.hpp>
#include <new>
#include <ostream>
#include <string>
#include <thread>

namespace mis::optimal {

// width x height estimators in one block, row by row, and the numbers of samples a pass that all of them have
// in common. Add samples to any pixel; threads and ranks add to films, or tiles, of their own, merged in any
// order.
template <int M, int Channels = 3, class T = double> struct film {
    static_assert(M != dynamic, "estimators of a number of techniques known at run time lie on the heap");
    using estimator_type = estimator<M, Channels, T>;

    int width = 0, height = 0;
    std::array<double, static_cast<std::size_t>(M)> counts{};
    std::vector<estimator_type> pixels;

    film() = default;
    // A film without pixels if a number is negative, which is asserted in debug builds.
    film(int columns, int rows, const std::array<double, static_cast<std::size_t>(M)>& samples)
        : width(columns > 0 && rows > 0 ? columns : 0), height(columns > 0 && rows > 0 ? rows : 0),
          counts(samples), pixels(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {
        assert(columns >= 0 && rows >= 0);
    }

    // The pixel must be there, which is asserted in debug builds and not looked at otherwise.
    estimator_type& at(int x, int y) {
        assert(x >= 0 && x < width && y >= 0 && y < height);
        return pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                      static_cast<std::size_t>(x)];
    }
    const estimator_type& at(int x, int y) const { return const_cast<film*>(this)->at(x, y); }
};

namespace detail {

// Whether it has as many pixels as it says: its members are everybody's.
template <int M, int Channels, class T> bool is_whole(const film<M, Channels, T>& f) {
    return f.width >= 0 && f.height >= 0 &&
           f.pixels.size() == static_cast<std::size_t>(f.width) * static_cast<std::size_t>(f.height);
}

} // namespace detail

// Adds a tile whose first pixel is (x, y) of the film, or a whole film at (0, 0). Returns an empty string, or
// why it cannot be: it must lie within the film and have the same counts. Nothing is then added.
template <int M, int Channels, class T>
[[nodiscard]] std::string merge(film<M, Channels, T>& to, const film<M, Channels, T>& tile, int x = 0,
                                int y = 0) {
    const auto size = [](const film<M, Channels, T>& f) {
        return std::to_string(f.width) + " x " + std::to_string(f.height);
    };
    for (const auto& f : {std::cref(to), std::cref(tile)})
        if (!detail::is_whole(f.get()))
            return "a film of " + size(f) + " with " + std::to_string(f.get().pixels.size()) + " pixels";
    if (x < 0 || y < 0 || x > to.width - tile.width || y > to.height - tile.height)
        return "a tile of " + size(tile) + " at (" + std::to_string(x) + ", " + std::to_string(y) +
               ") is not within a film of " + size(to);
    if (tile.counts != to.counts)
        return "films of different counts";
    for (int row = 0; row < tile.height; ++row)
        for (int column = 0; column < tile.width; ++column)
            to.at(x + column, y + row) += tile.at(column, row);
    return {};
}

// Calls visit(i) for all pixels i of the film, row by row or, with several threads, in any order. 0 threads:
// one for each processor.
template <int M, int Channels, class T, class Visit>
void for_each_pixel(const film<M, Channels, T>& f, int threads, const Visit& visit) {
    constexpr std::size_t block = 64;
    std::atomic<std::size_t> next{0};
    const auto work = [&] {
        for (std::size_t first; (first = next.fetch_add(block)) < f.pixels.size();)
            for (std::size_t i = first; i < first + block && i < f.pixels.size(); ++i)
                visit(i);
    };
    const unsigned most = threads > 0 ? static_cast<unsigned>(threads) : std::thread::hardware_concurrency();
    std::vector<std::thread> others;
    for (unsigned k = 1; k < most; ++k)
        others.emplace_back(work);
    work();
    for (auto& thread : others)
        thread.join();
}

// The direct estimate of every pixel, per channel, row by row. The same for any number of threads.
template <int M, int Channels, class T>
std::vector<std::array<T, static_cast<std::size_t>(Channels)>> integrals(const film<M, Channels, T>& f,
                                                                         int threads = 0) {
    std::vector<std::array<T, static_cast<std::size_t>(Channels)>> result(f.pixels.size());
    for_each_pixel(f, threads, [&](std::size_t i) { result[i] = integral(f.pixels[i], f.counts); });
    return result;
}

namespace detail {

// Calls visit(pointer, size in bytes) for all arrays of numbers that a pixel consists of.
template <class Pixel, class Visit> void for_each_array(Pixel& pixel, const Visit& visit) {
    visit(&pixel.values[0], sizeof pixel.values);
    visit(&pixel.products[0], sizeof pixel.products);
    visit(&pixel.squares[0], sizeof pixel.squares);
}

// The first line of a saved film, and a number that reads differently where bytes are in another order.
template <int M, int Channels, class T> std::string film_heading() {
    using number = typename estimator<M, Channels, T>::number;
    return "mis optimal film 1, techniques " + std::to_string(M) + ", channels " + std::to_string(Channels) +
           ", bytes per number " + std::to_string(sizeof(number));
}
constexpr std::int32_t film_byte_order = 0x01020304;
constexpr std::int32_t most_film_pixels = 1 << 28;

} // namespace detail

// Writes a film, to be read by this type of film on machines of the same byte order. The stream must be
// binary; whether it could be written is its state. A film whose pixels are not width times height, or that
// has more than 2^28, is not written, and the stream fails.
template <int M, int Channels, class T> void save(std::ostream& out, const film<M, Channels, T>& f) {
    if (!detail::is_whole(f) || f.pixels.size() > static_cast<std::size_t>(detail::most_film_pixels)) {
        out.setstate(std::ios::failbit);
        return;
    }
    out << detail::film_heading<M, Channels, T>() << '\n';
    const std::int32_t start[] = {detail::film_byte_order, f.width, f.height};
    const auto write = [&](const void* from, std::size_t size) {
        out.write(static_cast<const char*>(from), static_cast<std::streamsize>(size));
    };
    write(&start[0], sizeof start);
    write(&f.counts[0], sizeof f.counts);
    for (const auto& pixel : f.pixels)
        detail::for_each_array(pixel, write);
}

namespace detail {

// What is wrong, or null. Without exceptions what is too large for the memory ends the program, as it does
// everywhere.
template <int M, int Channels, class T, class Read>
const char* read_pixels(std::istream& in, Read&& read, std::int32_t count, film<M, Channels, T>& f) {
    const auto read_all = [&]() -> const char* {
        for (std::int32_t left = count; left > 0; --left) {
            f.pixels.emplace_back();
            for_each_array(f.pixels.back(), read);
            if (!in)
                return "the film is cut off";
        }
        return nullptr;
    };
#ifdef __cpp_exceptions
    try {
        return read_all();
    } catch (const std::bad_alloc&) {
        return "a film too large for the memory";
    }
#else
    return read_all();
#endif
}

} // namespace detail

// Reads a film that save has written, to go on with it. Returns an empty string, or what is wrong with the
// stream, in one line; the film then stays as it was. It takes no more memory than some three times what
// the stream has, whatever the stream says of itself.
template <int M, int Channels, class T> std::string load(std::istream& in, film<M, Channels, T>& f) {
    const std::string expected = detail::film_heading<M, Channels, T>();
    std::string heading;
    for (int c; heading.size() < expected.size() + 80 && (c = in.get()) != std::istream::traits_type::eof() &&
                c != '\n';)
        heading += static_cast<char>(c);
    if (heading == expected + '\r')
        return "a film from a stream that std::ios::binary has not opened";
    for (char& c : heading)
        c = c < ' ' || c > '~' ? '?' : c;
    if (heading != expected)
        return "no film of this type: '" + heading.substr(0, 80) + "' in place of '" + expected + "'";
    const auto read = [&](void* to, std::size_t size) {
        in.read(static_cast<char*>(to), static_cast<std::streamsize>(size));
    };
    std::int32_t start[3] = {};
    read(&start[0], sizeof start);
    if (!in)
        return "the film is cut off";
    if (start[0] != detail::film_byte_order)
        return "a film of another byte order";
    const std::int32_t width = start[1], height = start[2];
    if (width < 0 || height < 0 || (height > 0 && width > detail::most_film_pixels / height))
        return "a film of impossible size";
    film<M, Channels, T> loaded;
    read(&loaded.counts[0], sizeof loaded.counts);
    if (!in)
        return "the film is cut off";
    for (double n : loaded.counts)
        if (!detail::is_number(n) || n < 0)
            return "a film whose counts are no numbers of samples";
    if (const char* fault = detail::read_pixels(in, read, width * height, loaded))
        return fault;
    loaded.width = width;
    loaded.height = height;
    f = std::move(loaded);
    return {};
}

} // namespace mis::optimal
