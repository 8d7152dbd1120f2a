// The processes that share a render: the ranks of MPI, or this process alone.
#pragma once

#include <string>
#include <vector>

namespace lab {

class ranks {
public:
    int rank = 0, count = 1, on_this_machine = 1;

    // MPI is started only where a launcher (mpirun, srun) has started this process.
    ranks();
    ranks(const ranks&) = delete;
    ranks& operator=(const ranks&) = delete;
    ~ranks();

    // False for a program built without MPI that a launcher has started several times.
    bool can_exchange() const;

    // Sends to_each[k] to rank k, and returns at k what rank k has sent. Every rank must call it.
    std::vector<std::string> exchange(std::vector<std::string> to_each) const;

    // Ends all ranks at once with this status, whatever they are doing.
    [[noreturn]] void end_all(int status) const;
};

} // namespace lab
