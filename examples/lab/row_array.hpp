// The arrays that a render sums up. Rows of tiles of pixels are shared by processes, and checkpoints keep
// them all.
#pragma once

#include <string>
#include <type_traits>
#include <vector>

namespace lab {

struct row_array {
    std::string name; // for who reads about a damaged checkpoint
    char* data;
    std::size_t bytes_of_row;
    int rows, rows_of_tile; // of those, rows that belong together

    std::size_t size() const { return bytes_of_row * static_cast<std::size_t>(rows); }
    char* row(int i) const { return data + bytes_of_row * static_cast<std::size_t>(i); }
};

// Any number of whole rows of plain data.
template <class T> row_array rows_of(std::string name, std::vector<T>& values, int rows, int rows_of_tile) {
    static_assert(std::is_trivially_copyable_v<T>);
    return {std::move(name), reinterpret_cast<char*>(values.data()),
            values.size() / static_cast<std::size_t>(rows) * sizeof(T), rows, rows_of_tile};
}

} // namespace lab
