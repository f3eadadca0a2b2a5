// The files that a run has written into its folder, by what they hold: a file of another run beside
// the summary is told from its own.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

namespace defrec::cli {

class WrittenFiles {
  public:
    explicit WrittenFiles(std::filesystem::path folder) : folder_(std::move(folder)) {}

    // A file that has its name. Throws CliError(kOutput) where it cannot be read.
    void add(const std::string& name);
    // Objects with name, bytes and sha256, in the order of add.
    const nlohmann::ordered_json& json() const { return json_; }

  private:
    std::filesystem::path folder_;
    nlohmann::ordered_json json_ = nlohmann::ordered_json::array();
};

// The names whose files are not as summary.json in the folder says: files of another run, or
// changed. None where it says nothing.
std::vector<std::string> not_as_summarised(const std::filesystem::path& folder,
                                           const std::vector<std::string>& names);

}  // namespace defrec::cli
