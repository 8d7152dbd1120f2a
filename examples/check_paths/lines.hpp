// Lines of a file, plain or compressed with gzip, in constant memory.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <unistd.h>
#include <vector>
#include <zlib.h>

namespace check_paths {

struct close_descriptor {
    int descriptor;
    ~close_descriptor() { close(descriptor); }
};
struct end_inflate {
    void operator()(z_stream* stream) const {
        inflateEnd(stream);
        delete stream;
    }
};

// A file that is being read.
struct line_reader {
    std::unique_ptr<close_descriptor> file;
    std::int64_t file_size = -1; // as stored, compressed or not; -1 where unknown, as of a pipe
    std::int64_t bytes_read = 0; // so far, on the same scale
    std::int64_t line = 0;       // number of the last line read, from 1
    std::string failure;         // why reading ended before the file did
    bool is_waiting = false;     // that was what next_line said last

    std::unique_ptr<z_stream, end_inflate> gzip; // none: the file is plain
    std::vector<char> stored;                    // compressed, what gzip points to
    bool is_between_members = false;             // gzip may end here, or go on with another one

    std::vector<char> buffer;
    std::size_t begin = 0, end = 0; // the part of the buffer that is not read yet
    bool is_started = false;        // it is known whether the file is compressed
    bool is_text = false;           // and that its characters are single bytes
    bool is_at_end = false;         // nothing follows the buffer

    // Of a line that has been read in part only.
    std::size_t searched = 0, skipped = 0;
    bool is_too_long = false;
};

enum class line_status { line, too_long, waiting, end, failed };

// Longer lines are skipped; one that is much longer is no line, and reading fails.
inline constexpr std::size_t longest_line = std::size_t(16) << 20, longest_skipped = std::size_t(1) << 30;

// So many bytes behind a line may be read, whatever they are: the JSON parser looks ahead.
inline constexpr std::size_t line_padding = 64;

// Opens a file by name, "-" being standard input. Returns false, and why in `failure`, where it cannot.
bool open_lines(line_reader& reader, const std::string& name);

// The same of a file descriptor, which is closed with the reader.
bool open_lines(line_reader& reader, int descriptor);

// The next line without its end, valid until the next call. `waiting`: the descriptor does not block and has
// nothing for now; the next call goes on. `failed`: the rest cannot be read (a compressed file that is cut
// off or followed by something else, a device's error, text in UTF-16); a line that has been read in part
// only is dropped.
line_status next_line(line_reader& reader, std::string_view& line);

// Where a reader is waiting, waits until there is something to read, and returns true; false where it is not.
bool wait_for_more(const line_reader& reader);

} // namespace check_paths
