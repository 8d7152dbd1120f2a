// A render shared by ranks. Passes are dealt to them in turn, and so are the image's rows of tiles: a pass's
// rank sends each contribution to the rank that sums its pixel, which adds up what it gets pass by pass, in
// the order that one process would have. So each sum is the same to the last bit for any number of ranks.
#pragma once

#include "ranks.hpp"
#include "render.hpp"
#include "row_array.hpp"
#include <cstring>
#include <stdexcept>
#include <string_view>

namespace lab {

// ---- What all ranks must agree upon ----

// Known to all ranks: rank 0 alone reports it.
struct agreed_failure : std::runtime_error {
    using std::runtime_error::runtime_error;
};

// Rank 0's bytes, on all ranks.
inline std::string from_first(const ranks& all, const std::string& bytes) {
    std::vector<std::string> to_each(static_cast<std::size_t>(all.count));
    if (all.rank == 0)
        to_each.assign(to_each.size(), bytes);
    return all.exchange(std::move(to_each))[0];
}

// Whether it is true on any rank.
inline bool is_any(const ranks& all, bool own) {
    bool any = false;
    const std::vector<std::string> to_each(static_cast<std::size_t>(all.count), own ? "yes" : "");
    for (const auto& bytes : all.exchange(to_each))
        any |= !bytes.empty();
    return any;
}

// Calls f on rank 0 alone, for files. Where it throws, all ranks throw: none waits for another one that has
// ended.
template <class F> void on_first(const ranks& all, F&& f) {
    std::string failure;
    if (all.rank == 0)
        try {
            f();
        } catch (const std::exception& error) {
            failure = error.what();
        }
    failure = from_first(all, failure);
    if (!failure.empty())
        throw agreed_failure(failure);
}

// Calls f on all ranks, where it does the same: rank 0 alone reports what it throws.
template <class F> void on_all_alike(const ranks& all, F&& f) {
    on_first(all, f);
    if (all.rank != 0)
        f();
}

// ---- Plain data as bytes ----

template <class T> void append(std::string& bytes, const T* values, std::size_t count) {
    static_assert(std::is_trivially_copyable_v<T>);
    bytes.append(reinterpret_cast<const char*>(values), count * sizeof(T));
}
template <class T> void take(std::string_view& bytes, T* values, std::size_t count) {
    static_assert(std::is_trivially_copyable_v<T>);
    if (count > 0) // no values: a null pointer
        std::memcpy(values, bytes.data(), count * sizeof(T));
    bytes.remove_prefix(count * sizeof(T));
}
// With their number before them.
template <class Values> void append(std::string& bytes, const Values& values) {
    const std::size_t count = values.size();
    append(bytes, &count, 1);
    append(bytes, values.data(), count);
}
template <class Values> void take(std::string_view& bytes, Values& values) {
    std::size_t count = 0;
    take(bytes, &count, 1);
    values.resize(count);
    take(bytes, values.data(), count);
}

// ---- Passes ----

// A pass in parts: what it contributes to the pixels of each rank. Checks and dumped lines go to rank 0.
template <class Real>
std::vector<std::string> split(pass_result<Real> made, int width, int rows_of_tile, int count) {
    std::vector<row_result<Real>> parts(static_cast<std::size_t>(count));
    const auto part_of = [&](int pixel) -> auto& {
        return parts[static_cast<std::size_t>(pixel / width / rows_of_tile % count)];
    };
    for (auto& row : made.rows) {
        for (const auto& c : row.contributions)
            part_of(c.pixel).contributions.push_back(c);
        for (const auto& s : row.samples)
            part_of(s.pixel).samples.push_back(s);
        parts[0].checks.add(row.checks);
        parts[0].dump.insert(parts[0].dump.end(), row.dump.begin(), row.dump.end());
        row = {};
    }
    std::vector<std::string> all;
    for (auto& part : parts) {
        std::string& bytes = all.emplace_back();
        append(bytes, part.contributions);
        append(bytes, part.samples);
        append(bytes, &part.checks, 1);
        for (const auto& line : part.dump)
            append(bytes, line);
        part = {};
    }
    return all;
}
template <class Real> pass_result<Real> joined(int pass, std::string_view bytes) {
    row_result<Real> part;
    take(bytes, part.contributions);
    take(bytes, part.samples);
    take(bytes, &part.checks, 1);
    while (!bytes.empty())
        take(bytes, part.dump.emplace_back());
    return {pass, {std::move(part)}};
}

// Where a pass is among the others.
struct pass_place {
    bool ends_round, is_last; // of the passes that ranks render at the same time; of all
};

// Renders the passes from the first on. stops(), asked once in a round, must say the same on all ranks: then
// this round is the last. on_pass(pass_result, pass_place) is given all passes in turn, each with what
// contributes to the pixels of this rank.
template <class Real, class Stops, class OnPass>
void render(const ranks& all, int rows_of_tile, const scene<Real>& scene, const settings<Real>& set,
            int first_pass, Stops&& stops, OnPass&& on_pass) {
    const renderer<Real> first = make_renderer(scene, set);
    bool goes_on = true;
    for (int next = first_pass; next < set.passes && goes_on;) {
        const int round = next, own = round + all.rank;
        pass_result<Real> made;
        if (own < set.passes)
            made = make_pass(first, set, own);
        std::vector<std::string> parts(static_cast<std::size_t>(all.count));
        if (all.count > 1)
            parts = all.exchange(split(std::move(made), set.width, rows_of_tile, all.count));
        goes_on = !stops();
        while (next < std::min(set.passes, round + all.count)) {
            if (all.count > 1)
                made = joined<Real>(next, parts[static_cast<std::size_t>(next - round)]);
            parts[static_cast<std::size_t>(next - round)] = {};
            ++next;
            const bool ends_round = next == std::min(set.passes, round + all.count);
            on_pass(made, pass_place{ends_round, ends_round && (!goes_on || next == set.passes)});
        }
    }
}

// ---- Sums ----

// Calls visit(rank, row, bytes) for the rows of some arrays that are not rank 0's.
template <class Visit>
void for_each_shared_row(const row_array* first, const row_array* last, int count, Visit&& visit) {
    for (; first != last; ++first)
        for (int i = 0; i < first->rows; ++i)
            if (const int owner = i / first->rows_of_tile % count; owner != 0)
                visit(owner, first->row(i), first->bytes_of_row);
}

// Gives rank 0 the rows that other ranks have summed; or those ranks the rows that rank 0 has read.
enum class rows_go { to_first, to_owners };
inline void exchange_rows(const ranks& all, const std::vector<row_array>& arrays, rows_go where) {
    constexpr std::size_t most = std::size_t(64) << 20; // bytes at a time, or one array
    const auto sender = [&](int owner) { return where == rows_go::to_first ? owner : 0; };
    const auto receiver = [&](int owner) { return where == rows_go::to_first ? 0 : owner; };
    const row_array *first = arrays.data(), *const end = first + arrays.size();
    while (all.count > 1 && first != end) {
        const row_array* last = first;
        for (std::size_t size = 0; last != end && (last == first || size + last->size() <= most); ++last)
            size += last->size();
        std::vector<std::string> bytes(static_cast<std::size_t>(all.count));
        for_each_shared_row(first, last, all.count, [&](int owner, const char* row, std::size_t size) {
            if (sender(owner) == all.rank)
                append(bytes[static_cast<std::size_t>(receiver(owner))], row, size);
        });
        bytes = all.exchange(std::move(bytes));
        std::vector<std::string_view> left(bytes.begin(), bytes.end());
        for_each_shared_row(first, last, all.count, [&](int owner, char* row, std::size_t size) {
            if (receiver(owner) == all.rank)
                take(left[static_cast<std::size_t>(sender(owner))], row, size);
        });
        first = last;
    }
}

} // namespace lab
