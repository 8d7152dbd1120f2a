#include "lines.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

namespace check_paths {

namespace {

constexpr std::size_t chunk = std::size_t(256) << 10;

// Reads bytes as they are stored; 0 at the end, after a failure, and while waiting.
std::size_t read_stored(line_reader& r, char* to, std::size_t most) {
    for (;;) {
        const ssize_t got = read(r.file->descriptor, to, most);
        if (got < 0 && errno == EINTR)
            continue;
        r.is_waiting = got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK);
        if (got < 0 && !r.is_waiting)
            r.failure = std::strerror(errno);
        r.bytes_read += std::max<ssize_t>(got, 0);
        return static_cast<std::size_t>(std::max<ssize_t>(got, 0));
    }
}

bool starts_gzip(const char* bytes, std::size_t count) {
    return count >= 2 && bytes[0] == '\x1f' && bytes[1] == '\x8b';
}

// Goes on with the next member of a compressed file, if one follows. Anything else is not what gzip writes.
bool begin_member(line_reader& r) {
    z_stream& z = *r.gzip;
    if (z.avail_in < 2) { // the two bytes that begin a member may be apart
        std::memmove(r.stored.data(), z.next_in, z.avail_in);
        z.next_in = reinterpret_cast<unsigned char*>(r.stored.data());
        while (z.avail_in < 2) {
            const std::size_t got = read_stored(r, r.stored.data() + z.avail_in, chunk - z.avail_in);
            z.avail_in += static_cast<unsigned>(got);
            if (got == 0)
                break;
        }
    }
    if (z.avail_in == 0 || r.is_waiting || !r.failure.empty())
        return false;
    if (!starts_gzip(reinterpret_cast<const char*>(z.next_in), z.avail_in)) {
        r.failure = "something else follows the compressed data";
        return false;
    }
    r.is_between_members = false;
    return inflateReset(&z) == Z_OK;
}

// Reads decompressed bytes; 0 at the end, after a failure, and while waiting.
std::size_t read_compressed(line_reader& r, char* to, std::size_t most) {
    z_stream& z = *r.gzip;
    z.next_out = reinterpret_cast<unsigned char*>(to);
    z.avail_out = static_cast<unsigned>(most);
    while (z.avail_out > 0) {
        if (r.is_between_members && !begin_member(r))
            break;
        if (z.avail_in == 0) {
            z.next_in = reinterpret_cast<unsigned char*>(r.stored.data());
            z.avail_in = static_cast<unsigned>(read_stored(r, r.stored.data(), chunk));
        }
        if (z.avail_in == 0 && !r.is_waiting && r.failure.empty())
            r.failure = "the compressed data is cut off";
        if (z.avail_in == 0)
            break;
        const int status = inflate(&z, Z_NO_FLUSH);
        r.is_between_members = status == Z_STREAM_END;
        if (status != Z_OK && status != Z_STREAM_END && status != Z_BUF_ERROR) {
            r.failure = z.msg                   ? z.msg
                        : status == Z_MEM_ERROR ? "out of memory"
                                                : "the compressed data is damaged";
            break;
        }
    }
    return most - z.avail_out;
}

// What has been read of a file so far is compressed, and goes to the decompressor.
void start_gzip(line_reader& r, const char* bytes, std::size_t count) {
    constexpr int with_gzip_header = 15 + 16;
    auto z = std::make_unique<z_stream>();
    *z = {};
    if (inflateInit2(z.get(), with_gzip_header) != Z_OK) {
        r.failure = "out of memory";
        return;
    }
    r.gzip.reset(z.release());
    r.stored.assign(bytes, bytes + count);
    r.stored.resize(std::max(count, chunk));
    r.gzip->next_in = reinterpret_cast<unsigned char*>(r.stored.data());
    r.gzip->avail_in = static_cast<unsigned>(count);
}

// Text of two or four bytes per character, with or without a byte order mark. JSON has no byte 0.
const char* wide_encoding(std::string_view text) {
    const auto starts = [&](std::string_view with) { return text.substr(0, with.size()) == with; };
    using namespace std::string_view_literals;
    if (starts("\xff\xfe\0\0"sv) || starts("\0\0\xfe\xff"sv) || starts("{\0\0\0"sv) || starts("\0\0\0{"sv))
        return "UTF-32";
    if (starts("\xff\xfe"sv) || starts("\xfe\xff"sv) || starts("{\0"sv) || starts("\0{"sv))
        return "UTF-16";
    return nullptr;
}

// Reads more behind what is not read yet, which moves to the buffer's front. The first bytes tell what the
// file is: until there are enough of them, the buffer is neither stored as it should be nor text.
void fill(line_reader& r) {
    const std::size_t unread = r.end - r.begin;
    if (r.begin > 0)
        std::memmove(r.buffer.data(), r.buffer.data() + r.begin, unread);
    r.begin = 0;
    r.end = unread;
    if (r.buffer.size() < unread + chunk + line_padding)
        r.buffer.resize(2 * unread + chunk + line_padding);
    char* const to = r.buffer.data() + r.end;
    r.end += r.gzip ? read_compressed(r, to, chunk) : read_stored(r, to, chunk);
    r.is_at_end = (r.end == unread && !r.is_waiting) || !r.failure.empty();
    if (!r.is_started && (r.end >= 2 || r.is_at_end)) {
        r.is_started = true;
        if (starts_gzip(r.buffer.data(), r.end)) {
            start_gzip(r, r.buffer.data(), r.end);
            r.end = 0;
            r.is_at_end = !r.failure.empty();
            return;
        }
    }
    if (!r.is_text && r.is_started && (r.end >= 4 || r.is_at_end)) {
        r.is_text = true;
        if (const char* const name = wide_encoding({r.buffer.data(), r.end})) {
            r.failure = std::string("the text is ") + name + ", not UTF-8";
            r.end = 0;
            r.is_at_end = true;
        }
    }
}

} // namespace

bool open_lines(line_reader& r, int descriptor) {
    r = {};
    struct stat info {};
    if (fstat(descriptor, &info) == 0 && S_ISREG(info.st_mode))
        r.file_size = info.st_size;
    r.file.reset(new close_descriptor{descriptor});
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
    r.is_waiting = false;
    for (;;) {
        const std::size_t unread = r.end - r.begin;
        const char* first = r.buffer.data() + r.begin;
        const void* found = r.is_text && unread > r.searched
                                ? std::memchr(first + r.searched, '\n', unread - r.searched)
                                : nullptr;
        const std::size_t length =
            found ? static_cast<std::size_t>(static_cast<const char*>(found) - first) : unread;
        if (!found && r.is_at_end) {
            r.begin = r.end;
            if (!r.failure.empty())
                return line_status::failed;
            if (unread == 0 && !r.is_too_long)
                return line_status::end;
        } else if (found) {
            r.begin += length + 1;
        } else {
            r.is_too_long |= unread > longest_line;
            if (r.is_too_long) {
                r.skipped += unread;
                r.begin = r.end;
            }
            r.searched = r.is_text ? r.end - r.begin : 0;
            fill(r);
            if (r.skipped > longest_skipped) {
                r.failure = "a line is longer than 1 GiB";
                r.is_waiting = false;
                r.is_at_end = true;
                r.begin = r.end;
            }
            if (r.is_waiting)
                return line_status::waiting;
            continue;
        }
        ++r.line;
        line = {first, length};
        const bool is_too_long = r.is_too_long || length > longest_line;
        r.searched = r.skipped = 0;
        r.is_too_long = false;
        return is_too_long ? line_status::too_long : line_status::line;
    }
}

bool wait_for_more(const line_reader& r) {
    if (!r.is_waiting)
        return false;
    pollfd file{r.file->descriptor, POLLIN, 0};
    while (poll(&file, 1, -1) < 0 && errno == EINTR) {
    }
    return true;
}

} // namespace check_paths
