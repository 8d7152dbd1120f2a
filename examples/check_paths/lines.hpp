// Lines of a file, plain or compressed with gzip, in constant memory.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>
#include <zlib.h>

namespace check_paths {

struct close_gzip {
    void operator()(gzFile file) const { gzclose(file); }
};

// A file that is being read. gzip's own reader passes plain files through unchanged.
struct line_reader {
    std::unique_ptr<gzFile_s, close_gzip> file;
    std::int64_t file_size = -1; // as stored, compressed or not; -1 where unknown, as of a pipe
    std::int64_t line = 0;       // number of the last line read, from 1
    std::string failure;         // why reading ended before the file did

    std::vector<char> buffer;
    std::size_t begin = 0, end = 0; // the part of the buffer that is not read yet
    bool is_at_end = false;         // nothing follows the buffer
};

enum class line_status { line, too_long, end, failed };

// Longer lines are skipped.
inline constexpr std::size_t longest_line = std::size_t(16) << 20;

// So many bytes behind a line may be read, whatever they are: the JSON parser looks ahead.
inline constexpr std::size_t line_padding = 64;

// Opens a file by name, "-" being standard input. Returns false, and why in `failure`, where it cannot.
bool open_lines(line_reader& reader, const std::string& name);

// The same of a file descriptor, which is closed with the reader.
bool open_lines(line_reader& reader, int descriptor);

// The next line without its end, valid until the next call. `failed`: the rest cannot be read (a compressed
// file that is cut off, a device's error); a line that has been read in part only is dropped.
line_status next_line(line_reader& reader, std::string_view& line);

// How far reading has come, on the scale of file_size.
std::int64_t bytes_read(const line_reader& reader);

} // namespace check_paths
