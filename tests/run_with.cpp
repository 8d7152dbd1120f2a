// SPDX-License-Identifier: MIT
// Runs a program as a shell could not portably: with a disk that fills up, with little memory, interrupted in
// the middle, with an input that does not wait.
//
//     run_with [--disk BYTES] [--memory BYTES] [--interrupt SIGNAL] [--input nonblocking] PROGRAM ARGUMENT..
//
// --disk: files cannot grow beyond so many bytes. --memory: of the address space. --interrupt: sends INT or
// TERM once the program handles it, or KILL, and it has worked for a while, in processor time, so that a busy
// machine changes nothing. --input: reading standard input fails where nothing is there yet. The exit status
// is the program's, 128 + n where a signal n ended it.
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <fstream>
#include <sstream>
#include <string>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace {

void limit(int resource, const char* bytes) {
    const rlim_t most = std::strtoull(bytes, nullptr, 10);
    const rlimit both{most, most};
    if (setrlimit(static_cast<__rlimit_resource>(resource), &both) != 0) {
        std::perror("setrlimit");
        std::exit(125);
    }
}

std::string file_of(pid_t process, const char* name) {
    std::ifstream file("/proc/" + std::to_string(process) + "/" + name);
    std::ostringstream all;
    all << file.rdbuf();
    return all.str();
}

bool handles(pid_t process, int signal) {
    if (signal == SIGKILL)
        return true;
    const std::string status = file_of(process, "status");
    const auto place = status.find("SigCgt:");
    return place != std::string::npos &&
           (std::strtoull(status.c_str() + place + 7, nullptr, 16) >> (signal - 1) & 1) != 0;
}

// In user mode, in ticks: the 14th field, counted behind the name, which may have spaces.
long ticks_of(pid_t process) {
    const std::string all = file_of(process, "stat");
    std::istringstream fields(all.substr(std::min(all.size(), all.rfind(')') + 1)));
    std::string skipped;
    for (int field = 3; field < 14; ++field)
        fields >> skipped;
    long ticks = 0;
    fields >> ticks;
    return ticks;
}

} // namespace

int main(int count, char** arguments) {
    int signal = 0, k = 1;
    for (; k + 1 < count && std::strncmp(arguments[k], "--", 2) == 0; k += 2) {
        const std::string option = arguments[k], value = arguments[k + 1];
        if (option == "--disk") {
            std::signal(SIGXFSZ, SIG_IGN);
            limit(RLIMIT_FSIZE, arguments[k + 1]);
        } else if (option == "--memory") {
            limit(RLIMIT_AS, arguments[k + 1]);
        } else if (option == "--interrupt") {
            signal = value == "INT" ? SIGINT : value == "TERM" ? SIGTERM : SIGKILL;
        } else if (option == "--input" && fcntl(STDIN_FILENO, F_SETFL, O_NONBLOCK) != 0) {
            std::perror("fcntl");
            return 125;
        }
    }
    const pid_t child = fork();
    if (child == 0) {
        execv(arguments[k], arguments + k);
        std::perror(arguments[k]);
        _exit(125);
    }
    int status = 0;
    if (signal != 0) {
        const long half_a_second = sysconf(_SC_CLK_TCK) / 2;
        long ticks_at_start = -1;
        for (bool sent = false; !sent && waitpid(child, &status, WNOHANG) == 0; usleep(10'000)) {
            if (ticks_at_start < 0 && handles(child, signal))
                ticks_at_start = ticks_of(child);
            sent = ticks_at_start >= 0 && ticks_of(child) - ticks_at_start > half_a_second;
            if (sent)
                kill(child, signal);
        }
    }
    waitpid(child, &status, 0); // an error where it has ended before: then the status is there
    return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}
