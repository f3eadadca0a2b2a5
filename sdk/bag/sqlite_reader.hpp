// Messages of a bag that rosbag2 wrote into an SQLite file: tables `topics` and `messages`, as of
// its storage plugin sqlite3. The file is only read, and nothing is written beside it unless its
// recorder was killed and left a log.
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "sdk/bag/bag_reader.hpp"

namespace defrec::cli {

// Throws CliError(kInput) for what is no such file or cannot be opened, and where this build has no
// SQLite.
std::unique_ptr<BagReader> open_sqlite_bag(const std::filesystem::path& path);

// Up to where the file is damaged. Throws likewise.
std::vector<BagTopic> topics_of_sqlite_bag(const std::filesystem::path& path);

}  // namespace defrec::cli
