// Files that say so where they could not be written: a disk that is full, a device that fails.
#pragma once

#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <stdexcept>
#include <string>
#include <string_view>
#include <sys/stat.h>
#include <unistd.h>

namespace tools {

// Writes bytes to a descriptor. Returns how many could be, and why not more in `error`, 0 where all could.
inline std::size_t write_bytes(int descriptor, std::string_view bytes, int& error) {
    std::size_t written = 0;
    error = 0;
    while (written < bytes.size()) {
        const ssize_t n = write(descriptor, bytes.data() + written, bytes.size() - written);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0) {
            error = n < 0 ? errno : ENOSPC;
            break;
        }
        written += static_cast<std::size_t>(n);
    }
    return written;
}

// Lines of a file. Where the disk fills up, the file ends with the last line that is whole.
class line_file {
public:
    // Throws std::runtime_error where it cannot be opened.
    explicit line_file(const std::string& file) : name(file) {
        descriptor = open(name.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
        if (descriptor < 0)
            throw std::runtime_error("'" + name + "' cannot be written: " + std::strerror(errno));
    }
    line_file(const line_file&) = delete;
    line_file& operator=(const line_file&) = delete;
    ~line_file() {
        flush();
        close(descriptor);
    }

    // After a failure, lines are counted, but not kept.
    void add(std::string_view line) {
        constexpr std::size_t most = std::size_t(64) << 10;
        ++lines_added;
        if (error != 0)
            return;
        buffer.append(line) += '\n';
        ++lines_waiting;
        if (buffer.size() >= most)
            flush();
    }

    // Throws std::runtime_error, and how many lines the file has, where it does not have all.
    void finish() {
        flush();
        if (error != 0)
            throw std::runtime_error("'" + name + "' has only the first " + std::to_string(lines_written) +
                                     " of " + std::to_string(lines_added) +
                                     " lines: " + std::strerror(error));
    }

private:
    void flush() {
        if (error != 0)
            return;
        const std::size_t written = write_bytes(descriptor, buffer, error);
        if (error == 0) {
            lines_written += lines_waiting;
            bytes_written += static_cast<std::int64_t>(written);
        } else if (struct stat info{}; fstat(descriptor, &info) == 0 && S_ISREG(info.st_mode)) {
            const std::size_t whole = buffer.rfind('\n', written - 1) + 1;
            for (const char c : std::string_view(buffer).substr(0, written > 0 ? whole : 0))
                lines_written += c == '\n', ++bytes_written;
            if (ftruncate(descriptor, bytes_written) != 0)
                error = errno;
        }
        buffer.clear();
        lines_waiting = 0;
    }

    std::string name, buffer;
    int descriptor = -1, error = 0;
    std::int64_t lines_added = 0, lines_waiting = 0, lines_written = 0, bytes_written = 0;
};

// A whole file. Throws std::runtime_error where it cannot be written; what there is of it is removed.
inline void write_file(const std::string& name, std::string_view bytes) {
    const int descriptor = open(name.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    int error = descriptor < 0 ? errno : 0;
    if (descriptor >= 0) {
        write_bytes(descriptor, bytes, error);
        struct stat info {};
        const bool is_file = fstat(descriptor, &info) == 0 && S_ISREG(info.st_mode);
        if (close(descriptor) != 0 && error == 0)
            error = errno;
        if (error != 0 && is_file)
            unlink(name.c_str());
    }
    if (error != 0)
        throw std::runtime_error("'" + name + "' cannot be written: " + std::strerror(error));
}

// Replaces a whole file: fill(write) writes its bytes, piece by piece, to a file of the same name and ".new",
// which takes the old one's place once it is on the disk. Throws std::runtime_error where that fails; then
// the old one is as it was.
template <class Fill> void replace_file(const std::string& name, Fill&& fill) {
    const std::string fresh = name + ".new";
    const int descriptor = open(fresh.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    int error = descriptor < 0 ? errno : 0;
    if (descriptor >= 0) {
        fill([&](std::string_view bytes) {
            if (error == 0)
                write_bytes(descriptor, bytes, error);
        });
        if (error == 0 && fsync(descriptor) != 0)
            error = errno;
        if (close(descriptor) != 0 && error == 0)
            error = errno;
        if (error == 0 && std::rename(fresh.c_str(), name.c_str()) != 0)
            error = errno;
        if (error != 0)
            unlink(fresh.c_str());
    }
    if (error != 0)
        throw std::runtime_error("'" + name + "' cannot be written: " + std::strerror(error));
}

// Things to do of which none is left out because another one fails.
class attempts {
public:
    template <class F> void run(F&& f) {
        try {
            f();
        } catch (const std::exception& error) {
            failures += (failures.empty() ? "" : "; ") + std::string(error.what());
        }
    }
    // Throws std::runtime_error with all that has failed, in one line.
    void finish() const {
        if (!failures.empty())
            throw std::runtime_error(failures);
    }

private:
    std::string failures;
};

// Throws std::runtime_error where not all of standard output could be written, now or before.
inline void finish_standard_output() {
    errno = 0;
    const bool is_flushed = std::fflush(stdout) == 0; // nothing to flush after a failure: the error stays
    if (!is_flushed || std::ferror(stdout) != 0)
        throw std::runtime_error(std::string("standard output could not all be written") +
                                 (errno != 0 ? std::string(": ") + std::strerror(errno) : ""));
}

} // namespace tools
