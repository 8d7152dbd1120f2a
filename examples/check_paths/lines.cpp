#include "lines.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace check_paths {

namespace {

constexpr std::size_t chunk = std::size_t(256) << 10;

void note_failure(line_reader& r) {
    int error = Z_OK;
    const char* message = gzerror(r.file.get(), &error);
    if (error == Z_OK || error == Z_STREAM_END)
        return;
    if (error == Z_ERRNO)
        r.failure = std::strerror(errno);
    else if (error == Z_BUF_ERROR)
        r.failure = "the compressed data is cut off";
    else
        r.failure = *message ? message : "the compressed data is damaged";
}

// Reads more behind what is not read yet, which moves to the buffer's front.
void fill(line_reader& r) {
    const std::size_t unread = r.end - r.begin;
    if (r.begin > 0)
        std::memmove(r.buffer.data(), r.buffer.data() + r.begin, unread);
    r.begin = 0;
    r.end = unread;
    if (r.buffer.size() < unread + chunk + line_padding)
        r.buffer.resize(2 * unread + chunk + line_padding);
    const int got = gzread(r.file.get(), r.buffer.data() + r.end, chunk);
    if (got > 0)
        r.end += static_cast<std::size_t>(got);
    if (got < static_cast<int>(chunk)) {
        r.is_at_end = true;
        note_failure(r);
    }
}

} // namespace

bool open_lines(line_reader& r, int descriptor) {
    r = {};
    struct stat info {};
    if (fstat(descriptor, &info) == 0 && S_ISREG(info.st_mode))
        r.file_size = info.st_size;
    r.file.reset(gzdopen(descriptor, "rb"));
    if (!r.file) {
        r.failure = "out of memory";
        close(descriptor);
        return false;
    }
    gzbuffer(r.file.get(), chunk);
    return true;
}

bool open_lines(line_reader& r, const std::string& name) {
    const int descriptor = name == "-" ? dup(STDIN_FILENO) : open(name.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) {
        r = {};
        r.failure = std::strerror(errno);
        return false;
    }
    return open_lines(r, descriptor);
}

line_status next_line(line_reader& r, std::string_view& line) {
    std::size_t searched = 0;
    bool is_too_long = false;
    for (;;) {
        const std::size_t unread = r.end - r.begin;
        const char* first = r.buffer.data() + r.begin;
        const void* found =
            unread > searched ? std::memchr(first + searched, '\n', unread - searched) : nullptr;
        const std::size_t length =
            found ? static_cast<std::size_t>(static_cast<const char*>(found) - first) : unread;
        if (!found && r.is_at_end) {
            r.begin = r.end;
            if (!r.failure.empty())
                return line_status::failed;
            if (unread == 0 && !is_too_long)
                return line_status::end;
        } else if (found) {
            r.begin += length + 1;
        } else {
            is_too_long |= unread > longest_line;
            if (is_too_long)
                r.begin = r.end;
            searched = r.end - r.begin;
            fill(r);
            continue;
        }
        ++r.line;
        line = {first, length};
        return is_too_long || length > longest_line ? line_status::too_long : line_status::line;
    }
}

std::int64_t bytes_read(const line_reader& r) {
    const std::int64_t stored = gzoffset(r.file.get());
    return stored >= 0 ? stored : gztell(r.file.get()); // a pipe has no offset
}

} // namespace check_paths
