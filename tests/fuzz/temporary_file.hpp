// SPDX-License-Identifier: MIT
#pragma once

#include <cstdio>
#include <string_view>
#include <unistd.h>

namespace test {

// A descriptor of a file with this content, which is gone once it is closed. Negative where none can be made.
inline int temporary_file(std::string_view content) {
    std::FILE* file = std::tmpfile();
    if (!file)
        return -1;
    const bool is_written = std::fwrite(content.data(), 1, content.size(), file) == content.size() &&
                            std::fseek(file, 0, SEEK_SET) == 0;
    const int descriptor = is_written ? dup(fileno(file)) : -1;
    std::fclose(file);
    return descriptor;
}

} // namespace test
