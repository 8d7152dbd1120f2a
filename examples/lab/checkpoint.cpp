// The file: a line that says what it is; the heading, which is text; each array of sums. Heading and arrays
// have their size and their checksum before them. An array of zeros has a size of 0, and nothing behind it.
#include "checkpoint.hpp"
#include <algorithm>
#include <cstdint>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <tools/files.hpp>
#include <zlib.h>

namespace lab {
namespace {

// Bytes in another order read as another file.
constexpr std::string_view first_line = "mis laboratory checkpoint 1\n";
const std::string passes_line = "passes ";

struct part {
    std::uint64_t size, checksum;
};
std::uint64_t checksum_of(std::string_view bytes) {
    return crc32_z(0, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
}

class reader {
public:
    explicit reader(const std::string& file) : name(file), in(file, std::ios::binary) {
        struct stat info {};
        if (stat(name.c_str(), &info) != 0 && errno == ENOENT)
            is_missing = true;
        else if (!in || !S_ISREG(info.st_mode))
            refuse("cannot be read");
        length = info.st_size;
    }

    [[noreturn]] void refuse(const std::string& why) const {
        throw std::runtime_error("'" + name + "' " + why);
    }
    [[noreturn]] void refuse_at(const std::string& what) const {
        refuse("is damaged from byte " + std::to_string(place) + " on: " + what);
    }
    void read(char* to, std::size_t size, const std::string& what) {
        in.read(to, static_cast<std::streamsize>(size));
        if (!in)
            refuse("is cut off after " + std::to_string(length) + " bytes: " + what);
    }
    // The part that follows: buffer(size) is asked for memory, or null where it cannot have this size.
    template <class Buffer> void read_part(const std::string& what, Buffer&& buffer) {
        part p;
        place = in.tellg();
        read(reinterpret_cast<char*>(&p), sizeof p, what);
        char* const to = buffer(p.size);
        if (to == nullptr)
            refuse_at(what);
        read(to, p.size, what);
        if (checksum_of({to, p.size}) != p.checksum)
            refuse_at(what);
    }
    void finish() {
        place = in.tellg();
        if (in.peek() != std::ifstream::traits_type::eof())
            refuse_at("there is more than a checkpoint");
    }

    bool is_missing = false;

private:
    std::string name;
    std::ifstream in;
    std::int64_t length = 0, place = 0; // place: where the part begins
};

// Refuses settings that are not those wanted, by the first line that differs.
void compare(const reader& in, const std::string& settings, const std::string& wanted) {
    std::istringstream there(settings), here(wanted);
    for (std::string of, want; std::getline(there, of) && std::getline(here, want);)
        if (of != want)
            in.refuse("is of " + of + ", not " + want);
    if (settings != wanted)
        in.refuse("is of other options");
}

} // namespace

void write_checkpoint(const std::string& file, const std::string& settings, int passes,
                      const std::vector<row_array>& sums) {
    tools::replace_file(file, [&](auto&& write) {
        const auto write_part = [&](std::string_view bytes) {
            const part p{bytes.size(), checksum_of(bytes)};
            write({reinterpret_cast<const char*>(&p), sizeof p});
            write(bytes);
        };
        write(first_line);
        write_part(settings + passes_line + std::to_string(passes) + "\n");
        for (const auto& a : sums) {
            const std::string_view bytes(a.data, a.size());
            const bool is_zero = bytes.find_first_not_of('\0') == std::string_view::npos;
            write_part(is_zero ? std::string_view() : bytes);
        }
    });
}

int read_checkpoint(const std::string& file, const std::string& settings, int most_passes,
                    const std::vector<row_array>& sums) {
    reader in(file);
    if (in.is_missing)
        return 0;
    std::string line(first_line.size(), '\0'), heading;
    in.read(line.data(), line.size(), "the first line");
    if (line != first_line)
        in.refuse("is no checkpoint of this program");
    in.read_part("the heading", [&](std::uint64_t size) {
        constexpr std::uint64_t most = 1 << 16;
        heading.resize(std::min(size, most));
        return size <= most ? heading.data() : nullptr;
    });
    const auto end = std::min(heading.rfind(passes_line), heading.size());
    compare(in, heading.substr(0, end), settings);
    const int passes = std::atoi(heading.substr(std::min(end + passes_line.size(), heading.size())).c_str());
    if (passes > most_passes)
        in.refuse("has " + std::to_string(passes) + " passes, more than --samples " +
                  std::to_string(most_passes));
    for (const auto& a : sums)
        in.read_part(a.name, [&](std::uint64_t size) {
            std::fill(a.data, a.data + a.size(), '\0');
            return size == 0 || size == a.size() ? a.data : nullptr;
        });
    in.finish();
    return passes;
}

} // namespace lab
