// For tests: `defrec evaluate` as a process, as it starts processes of its own.
#pragma once

#include <doctest/doctest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <map>
#include <string>
#include <vector>

#include "sdk/io/csv.hpp"

namespace defrec::cli {

inline pid_t start_evaluate(const std::vector<std::string>& arguments) {
    std::vector<std::string> all{DEFREC_BUILD_DIR "/bin/defrec", "evaluate"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    for (std::string& argument : all) argv.push_back(argument.data());
    argv.push_back(nullptr);
    const pid_t child = ::fork();
    if (child == 0) {
        ::execv(argv[0], argv.data());
        ::_exit(99);
    }
    return child;
}

// Its exit code; -1: a signal.
inline int run_evaluate_program(const std::vector<std::string>& arguments) {
    const pid_t child = start_evaluate(arguments);
    int status = 0;
    REQUIRE(::waitpid(child, &status, 0) == child);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

// The reason of each clip in quarantine or doubtful, empty for the others.
inline std::map<std::string, std::string> reasons_of(const std::filesystem::path& out) {
    std::map<std::string, std::string> reasons;
    CsvReader results(out / "results.csv", {"clip", "reason"});
    while (results.next()) reasons[std::string(results.field(0))] = results.field(1);
    return reasons;
}

}  // namespace defrec::cli
