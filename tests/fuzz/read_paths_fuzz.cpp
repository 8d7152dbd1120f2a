// SPDX-License-Identifier: MIT
// libFuzzer on the reader of path dumps, and on the diagnosis of all that it accepts. An input is a whole
// file, plain or compressed.
#include "reader.hpp"
#include "temporary_file.hpp"

#include <algorithm>
#include <cstdlib>
#include <mis/verify/diagnosis.hpp>

namespace {

void require(bool holds) {
    if (!holds)
        std::abort();
}

bool is_printable(const std::string& text) {
    return std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c <= '~'; });
}

// The search for suspects takes milliseconds per record: few are enough.
void diagnose(const std::vector<mis::path_record>& records) {
    constexpr std::int64_t most_disagreeing = 2;
    mis::diagnosis d;
    for (const mis::path_record& record : records)
        if (d.disagreeing < most_disagreeing)
            mis::judge(d, record);
    mis::suspects_of(d);
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
    const int descriptor = test::temporary_file({reinterpret_cast<const char*>(data), size});
    require(descriptor >= 0);
    check_paths::path_reader reader;
    require(check_paths::open_lines(reader.lines, descriptor));
    std::vector<mis::path_record> records;
    mis::path_record record;
    for (;;) {
        std::string error;
        const auto status = check_paths::next_record(reader, record, error);
        const bool is_error =
            status == check_paths::read_status::malformed || status == check_paths::read_status::failed;
        require(is_error == !error.empty() && is_printable(error));
        if (status == check_paths::read_status::end || status == check_paths::read_status::failed)
            break;
        if (status == check_paths::read_status::record) {
            require(record.vertices.size() >= 2);
            records.push_back(record);
        }
    }
    diagnose(records);
    return 0;
}
