// See child_program.hpp.
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "sdk/base/os/descriptor.hpp"
#include "sdk/cli/devices/child_program.hpp"
#include "sdk/io/exit_code.hpp"

extern char** environ;  // NOLINT: POSIX asks the program to declare it

namespace defrec::cli {
namespace {

using Clock = std::chrono::steady_clock;

int wait_until(pid_t child, Clock::time_point deadline, bool& timed_out) {
    int status = 0;
    while (::waitpid(child, &status, WNOHANG) == 0) {
        if (Clock::now() >= deadline) {
            timed_out = true;
            ::kill(child, SIGKILL);
            ::waitpid(child, &status, 0);
            return status;
        }
        ::usleep(2000);
    }
    return status;
}

void read_until(int end, Clock::time_point deadline, std::string& text) {
    constexpr std::size_t kMaxRead = 1 << 20;
    char buffer[4096];
    while (text.size() < kMaxRead) {
        const auto left =
            std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
        pollfd waited{end, POLLIN, 0};
        if (left <= 0 || ::poll(&waited, 1, static_cast<int>(left)) <= 0) return;
        const ssize_t got = ::read(end, buffer, sizeof buffer);
        if (got <= 0) return;
        text.append(buffer, static_cast<std::size_t>(got));
    }
}

}  // namespace

ChildOutput run_child(const std::vector<std::string>& arguments, std::chrono::milliseconds limit) {
    std::vector<char*> argv;
    for (const std::string& argument : arguments)
        argv.push_back(const_cast<char*>(argument.c_str()));
    argv.push_back(nullptr);
    Pipe pipe;
    if (!pipe.open()) throw CliError(ExitCode::kInternal, "no pipe can be opened.");
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, pipe.write_end.get(), STDOUT_FILENO);
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    pid_t child = 0;
    const int failed = ::posix_spawn(&child, argv[0], &actions, nullptr, argv.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    if (failed != 0)
        throw CliError(ExitCode::kInternal,
                       arguments[0] + ": cannot be started again for the probe.");

    pipe.write_end.close();
    const Clock::time_point deadline = Clock::now() + limit;
    ChildOutput output;
    read_until(pipe.read_end.get(), deadline, output.text);
    const int status = wait_until(child, deadline, output.timed_out);
    if (WIFSIGNALED(status)) output.crash = ::strsignal(WTERMSIG(status));
    if (WIFEXITED(status)) output.exit_code = WEXITSTATUS(status);
    return output;
}

}  // namespace defrec::cli
