// A clip's process.
#include "sdk/evaluation/clip_process.hpp"

#include <fcntl.h>
#include <signal.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>

#include "sdk/io/exit_code.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

// The last line that was printed, without the program's name.
std::string last_line(const std::filesystem::path& log) {
    std::string text;
    try {
        constexpr std::size_t kLargestLog = 10'000'000;
        text = read_text_file(log, kLargestLog, ExitCode::kInternal);
    } catch (const CliError&) {
        return {};
    }
    text.erase(text.find_last_not_of("\n ") + 1);
    const std::size_t begin = text.rfind('\n') + 1;  // npos + 1 is 0
    constexpr std::string_view kProgram = "defrec: ";
    std::string line = text.substr(begin);
    if (line.starts_with(kProgram)) line.erase(0, kProgram.size());
    return line;
}

std::string failure_of(int status, const std::filesystem::path& log) {
    if (WIFSIGNALED(status)) {
        const int number = WTERMSIG(status);
        return "the process was ended by signal " + std::to_string(number) + " (" +
               ::strsignal(number) + ").";
    }
    const int code = WEXITSTATUS(status);
    if (code == 0) return {};
    const std::string line = last_line(log);
    return line.empty() ? "exit code " + std::to_string(code) + " without a message." : line;
}

// The child runs this between fork and exec: nothing in it allocates.
[[noreturn]] void become(char* const* arguments, int log, pid_t parent) {
    ::setpgid(0, 0);
    // kill -9 of the parent leaves no clip running.
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(1);
    ::signal(SIGINT, SIG_DFL);
    ::signal(SIGTERM, SIG_DFL);
    ::dup2(log, STDOUT_FILENO);
    ::dup2(log, STDERR_FILENO);
    ::execv(arguments[0], arguments);
    ::_exit(127);
}

}  // namespace

ClipProcess::ClipProcess(const std::vector<std::string>& arguments,
                         const std::filesystem::path& log, std::chrono::duration<double> time_limit)
    : log_(log), time_limit_(time_limit), start_(std::chrono::steady_clock::now()) {
    std::vector<char*> argv;
    for (const std::string& argument : arguments)
        argv.push_back(const_cast<char*>(argument.c_str()));
    argv.push_back(nullptr);
    const int file = ::open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (file < 0) throw CliError(ExitCode::kOutput, log.string() + ": the file cannot be written.");
    const pid_t parent = ::getpid();
    child_ = ::fork();
    if (child_ == 0) become(argv.data(), file, parent);
    ::close(file);
    if (child_ < 0)
        throw CliError(ExitCode::kInternal,
                       std::string("a process cannot be started (") + ::strerror(errno) + ").");
    ::setpgid(child_, child_);  // whoever is first, child or parent
}

ClipProcess::~ClipProcess() { end(); }

void ClipProcess::end() {
    if (child_ < 0) return;
    ::kill(-child_, SIGKILL);
    ::waitpid(child_, nullptr, 0);
    child_ = -1;
}

std::optional<std::string> ClipProcess::result() {
    int status = 0;
    if (::waitpid(child_, &status, WNOHANG) == child_) {
        ::kill(-child_, SIGKILL);  // what it has left behind
        child_ = -1;
        return failure_of(status, log_);
    }
    if (std::chrono::steady_clock::now() - start_ < time_limit_) return {};
    end();
    return "no end within the time limit of " + format_fixed(time_limit_.count(), 0) +
           " s; --time-limit sets another.";
}

}  // namespace defrec::cli
