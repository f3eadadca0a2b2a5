// For tests: `defrec` in a process of its own, and what it may leave.
#pragma once

#include <doctest/doctest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace defrec::cli {

// A process that ends with this object at the latest.
class ChildProcess {
  public:
    explicit ChildProcess(pid_t id) : id_(id) { REQUIRE(id > 0); }
    ~ChildProcess() {
        if (has_ended_) return;
        ::kill(id_, SIGKILL);
        ::waitpid(id_, &status_, 0);
    }
    ChildProcess(const ChildProcess&) = delete;
    ChildProcess& operator=(const ChildProcess&) = delete;

    pid_t id() const { return id_; }
    void send(int signal) const { REQUIRE(::kill(id_, signal) == 0); }
    // It must not end before that holds.
    template <class Condition>
    void wait_until(const Condition& condition) {
        while (!condition()) {
            has_ended_ = ::waitpid(id_, &status_, WNOHANG) != 0;
            REQUIRE_FALSE(has_ended_);
            ::usleep(10000);
        }
    }
    // Waits for its end. The exit code, or the negative number of the signal that ended it.
    int exit_code() {
        if (!has_ended_) {
            REQUIRE(::waitpid(id_, &status_, 0) == id_);
            has_ended_ = true;
        }
        return WIFEXITED(status_) ? WEXITSTATUS(status_) : -WTERMSIG(status_);
    }

  private:
    pid_t id_;
    bool has_ended_ = false;
    int status_ = 0;
};

// The program in a process of its own.
class ChildProgram : public ChildProcess {
  public:
    // output: its standard output; -1: this process's. file_size: bytes, to which its files may
    // grow.
    explicit ChildProgram(std::vector<std::string> arguments, int output = -1,
                          rlim_t file_size = RLIM_INFINITY)
        : ChildProcess(start(std::move(arguments), output, file_size)) {}

  private:
    static pid_t start(std::vector<std::string> arguments, int output, rlim_t file_size) {
        arguments.insert(arguments.begin(), DEFREC_BUILD_DIR "/bin/defrec");
        std::vector<char*> argv;
        for (std::string& argument : arguments) argv.push_back(argument.data());
        argv.push_back(nullptr);
        const pid_t child = ::fork();
        if (child != 0) return child;
        if (output >= 0) ::dup2(output, STDOUT_FILENO);
        rlimit limit{};
        ::getrlimit(RLIMIT_FSIZE, &limit);
        limit.rlim_cur = std::min(file_size, limit.rlim_max);
        ::setrlimit(RLIMIT_FSIZE, &limit);
        ::execv(argv[0], argv.data());
        ::_exit(99);
    }
};

inline bool has_partial_files(const std::filesystem::path& folder) {
    return std::any_of(std::filesystem::recursive_directory_iterator(folder),
                       std::filesystem::recursive_directory_iterator(), [](const auto& entry) {
                           return entry.path().filename().string().find(".partial") !=
                                  std::string::npos;
                       });
}

}  // namespace defrec::cli
