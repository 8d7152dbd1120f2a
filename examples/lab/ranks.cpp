#include "ranks.hpp"
#include <algorithm>
#include <cstdlib>
#ifdef LAB_HAS_MPI
#define OMPI_SKIP_MPICXX 1
#define MPICH_SKIP_MPICXX 1
#include <mpi.h>
#endif

namespace lab {
namespace {

// A number that launchers tell their processes by the environment, by one of these names; else `otherwise`.
int told(std::initializer_list<const char*> names, int otherwise) {
    for (const char* name : names)
        if (const char* const number = std::getenv(name))
            return std::atoi(number);
    return otherwise;
}

} // namespace

#ifdef LAB_HAS_MPI

// Without a launcher MPI could be started, too, but that takes longer than a small render.
ranks::ranks() {
    if (told({"OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK"}, -1) < 0)
        return;
    int provided = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided); // threads render, but exchange nothing
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &count);
    MPI_Comm machine;
    MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &machine);
    MPI_Comm_size(machine, &on_this_machine);
    MPI_Comm_free(&machine);
}

ranks::~ranks() {
    int is_started = 0;
    MPI_Initialized(&is_started);
    if (is_started)
        MPI_Finalize();
}

bool ranks::can_exchange() const { return true; }

std::vector<std::string> ranks::exchange(std::vector<std::string> to_each) const {
    const auto own = static_cast<std::size_t>(rank);
    std::vector<std::string> from_each(to_each.size());
    from_each[own] = std::move(to_each[own]);
    if (count == 1)
        return from_each;
    to_each[own].clear();
    std::vector<unsigned long long> sizes_to, sizes_from(to_each.size());
    for (const auto& bytes : to_each)
        sizes_to.push_back(bytes.size());
    MPI_Alltoall(sizes_to.data(), 1, MPI_UNSIGNED_LONG_LONG, sizes_from.data(), 1, MPI_UNSIGNED_LONG_LONG,
                 MPI_COMM_WORLD);
    std::vector<MPI_Request> requests;
    // In pieces, because MPI counts bytes in int.
    const auto in_pieces = [&](std::string& bytes, auto&& start) {
        constexpr std::size_t most = std::size_t(1) << 30;
        for (std::size_t first = 0; first < bytes.size(); first += most)
            start(bytes.data() + first, static_cast<int>(std::min(most, bytes.size() - first)),
                  &requests.emplace_back());
    };
    for (int k = 0; k < count; ++k)
        if (auto& bytes = from_each[static_cast<std::size_t>(k)]; k != rank) {
            bytes.resize(sizes_from[static_cast<std::size_t>(k)]);
            in_pieces(bytes, [k](char* to, int size, MPI_Request* request) {
                MPI_Irecv(to, size, MPI_BYTE, k, 0, MPI_COMM_WORLD, request);
            });
        }
    for (int k = 0; k < count; ++k)
        in_pieces(to_each[static_cast<std::size_t>(k)],
                  [k](const char* from, int size, MPI_Request* request) {
                      MPI_Isend(from, size, MPI_BYTE, k, 0, MPI_COMM_WORLD, request);
                  });
    MPI_Waitall(static_cast<int>(requests.size()), requests.data(), MPI_STATUSES_IGNORE);
    return from_each;
}

void ranks::end_all(int status) const {
    MPI_Abort(MPI_COMM_WORLD, status);
    std::abort(); // MPI_Abort does not come back
}

#else

ranks::ranks()
    : rank(told({"OMPI_COMM_WORLD_RANK", "PMI_RANK"}, 0)),
      count(told({"OMPI_COMM_WORLD_SIZE", "PMI_SIZE"}, 1)) {}
ranks::~ranks() = default;

bool ranks::can_exchange() const { return count == 1; }

std::vector<std::string> ranks::exchange(std::vector<std::string> to_each) const { return to_each; }

void ranks::end_all(int status) const { std::exit(status); }

#endif

} // namespace lab
