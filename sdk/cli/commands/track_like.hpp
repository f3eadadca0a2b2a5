// `defrec track --like summary.json`: the options that a run was given, kept in its summary and
// given again.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "sdk/session/track_session.hpp"

namespace defrec::cli {

// A command line that owns its words.
class Arguments {
  public:
    explicit Arguments(std::vector<std::string> words);
    Arguments(const Arguments&) = delete;
    Arguments& operator=(const Arguments&) = delete;
    int count() const { return static_cast<int>(words_.size()); }
    const char* const* values() const { return pointers_.data(); }

  private:
    std::vector<std::string> words_;
    std::vector<const char*> pointers_;
};

// Every option of the command, whether it was given or not; addresses of cameras without users and
// passwords.
std::vector<RecordedOption> recorded_options(const CLI::App& command);

// The words, with the options that the summary of --like holds in place where the command is
// `track` of app and has it: those that are given beside it count, and so do those that contradict
// them. The summary may be anybody's: options that the command does not have are refused, and so
// are pipelines, which run commands. Throws CliError, kInput for a file that is no summary.
Arguments with_recorded_options(const CLI::App& app, std::vector<std::string> words);

}  // namespace defrec::cli
