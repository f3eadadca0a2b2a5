// A bag of ROS 2: an MCAP or SQLite file, or the folder of `ros2 bag record` with one or several of
// them.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "sdk/bag/bag_reader.hpp"

namespace defrec::cli {

// The bag's files in the order of their messages. source: a file, or a folder with metadata.yaml,
// or one with *.mcap or *.db3 that a recorder left without it. Throws CliError(kInput).
std::vector<std::filesystem::path> files_of_bag(const std::filesystem::path& source);

// With what all files have. Throws CliError(kInput).
std::vector<BagTopic> topics_of_bag(const std::vector<std::filesystem::path>& files);

// Messages of the files, one file after the other.
class BagMessages {
  public:
    // Throws CliError(kInput) where the first file is none.
    explicit BagMessages(std::vector<std::filesystem::path> files);

    // False at the end, and where a file cannot be read further; fault() then says so.
    bool next(BagMessage& message);
    const std::string& fault() const { return fault_; }

  private:
    std::vector<std::filesystem::path> files_;
    std::size_t position_ = 0;  // of the file that is read
    std::unique_ptr<BagReader> reader_;
    std::string fault_;
};

}  // namespace defrec::cli
