// Processes that fail in every way a clip can.
#include "sdk/evaluation/clip_process.hpp"

#include <doctest/doctest.h>
#include <signal.h>
#include <unistd.h>

#include <cstdio>

#include "sdk/io/test_folder.hpp"
#include "sdk/io/text.hpp"

using namespace defrec::cli;

namespace {

std::string result_of(const TestFolder& folder, const std::string& script, double seconds = 600) {
    ClipProcess process({"/bin/sh", "-c", script}, folder.path() / "log.txt",
                        std::chrono::duration<double>(seconds));
    while (true) {
        if (const auto result = process.result()) return *result;
        ::usleep(1000);
    }
}

}  // namespace

TEST_CASE("a process that ends well has no failure, and its outputs are kept") {
    const TestFolder folder;
    CHECK(result_of(folder, "echo out; echo err >&2") == "");
    CHECK(TestFolder::read(folder / "log.txt") == "out\nerr\n");
}

TEST_CASE("a failure is the last message, a signal or the time limit") {
    const TestFolder folder;
    CHECK(result_of(folder, "echo first; echo 'defrec: frames/: not there.' >&2; exit 3") ==
          "frames/: not there.");
    CHECK(result_of(folder, "exit 9") == "exit code 9 without a message.");
    CHECK(result_of(folder, "kill -SEGV $$").find("signal 11") != std::string::npos);
    CHECK(result_of(folder, "sleep 600", 0.05).find("no end within the time limit") == 0);
    std::fflush(stdout);  // ThreadSanitizer's _exit writes what the child has a copy of
    ClipProcess absent({folder / "absent"}, folder.path() / "log.txt",
                       std::chrono::duration<double>(600));
    std::optional<std::string> result;
    while (!(result = absent.result())) ::usleep(1000);
    CHECK(*result == "exit code 127 without a message.");
}

TEST_CASE("what a process has started ends with it") {
    const TestFolder folder;
    const std::string script = "sleep 600 & echo $! > '" + (folder / "child") + ".new'; mv '" +
                               (folder / "child") + ".new' '" + (folder / "child") + "'; wait";
    const auto child_of = [&] {
        while (!std::filesystem::exists(folder / "child")) ::usleep(1000);
        const std::string text = TestFolder::read(folder / "child");
        return static_cast<pid_t>(*parse_integer(text.substr(0, text.find('\n'))));
    };
    pid_t child = 0;
    {
        const ClipProcess process({"/bin/sh", "-c", script}, folder.path() / "log.txt",
                                  std::chrono::duration<double>(600));
        child = child_of();
        CHECK(::kill(child, 0) == 0);
    }
    // Ended, and collected by init or waiting for it.
    const auto is_gone = [&] {
        const std::string stat = TestFolder::read("/proc/" + std::to_string(child) + "/stat");
        return stat.empty() || stat.find(") Z ") != std::string::npos;
    };
    while (!is_gone()) ::usleep(1000);
}
