// See bag.hpp.
#include "sdk/bag/bag.hpp"

#include <algorithm>
#include <utility>

#include "sdk/bag/mcap_reader.hpp"
#include "sdk/bag/sqlite_reader.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/text.hpp"
#include "sdk/io/yaml_document.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

constexpr char kMetadata[] = "metadata.yaml";
constexpr char kMcapExtension[] = ".mcap", kSqliteExtension[] = ".db3";
constexpr char kConvert[] =
    "`ros2 bag convert` writes it anew: storage_id mcap, and no compression_mode in its output "
    "options.";

bool is_sqlite(const fs::path& file) { return file.extension() == kSqliteExtension; }

std::unique_ptr<BagReader> open_reader(const fs::path& file) {
    if (is_sqlite(file)) return open_sqlite_bag(file);
    return std::make_unique<McapReader>(file);
}

[[noreturn]] void fail(const fs::path& path, const std::string& what) {
    throw CliError(ExitCode::kInput, path.string() + ": " + what);
}

// Text of a key of rosbag2's metadata; empty where there is none.
std::string text_of(const YamlNode& node, const std::string& key) {
    const YamlEntry* entry = node.find(key);
    return entry != nullptr ? entry->value.scalar : std::string();
}

// Files by the metadata. Their names are taken and not their folders, which older recorders wrote
// as well.
std::vector<fs::path> files_by_metadata(const fs::path& folder) {
    constexpr std::size_t kMostBytes = 10'000'000;
    YamlLimits limits;
    limits.bytes = kMostBytes;
    const YamlDocument document = YamlDocument::load(folder / kMetadata, ExitCode::kInput, limits);
    const YamlEntry* bag = document.root().find("rosbag2_bagfile_information");
    if (bag == nullptr)
        document.fail(1, "rosbag2_bagfile_information", "this key of a ROS 2 bag is missing.");
    const std::string storage = text_of(bag->value, "storage_identifier"),
                      compression = text_of(bag->value, "compression_mode");
    if (storage != "mcap" && storage != "sqlite3")
        document.fail(bag->line, "storage_identifier",
                      "'" + printable(storage.substr(0, 40)) +
                          "' is not read, mcap and sqlite3 are. " + kConvert);
    if (!compression.empty() && compression != "NONE" && compression != "none")
        document.fail(
            bag->line, "compression_mode",
            "files or messages that rosbag2 has compressed are not read; chunks that MCAP "
            "has are. " +
                std::string(kConvert));
    const YamlEntry* names = bag->value.find("relative_file_paths");
    if (names == nullptr || names->value.items.empty())
        document.fail(bag->line, "relative_file_paths", "the bag has no files.");
    std::vector<fs::path> files;
    for (const YamlNode& name : names->value.items)
        files.push_back(folder / fs::path(name.scalar).filename());
    return files;
}

std::vector<fs::path> files_by_name(const fs::path& folder) {
    std::vector<fs::path> files;
    std::error_code error;
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
         entry.increment(error))
        if (entry->path().extension() == kMcapExtension || is_sqlite(entry->path()))
            files.push_back(entry->path());
    if (error) fail(folder, "the folder cannot be read (" + error.message() + ").");
    std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
        return precedes_by_name(a.filename().string(), b.filename().string());
    });
    if (files.empty())
        fail(folder,
             "the folder holds no MCAP or SQLite file, and no metadata.yaml of a ROS 2 bag.");
    return files;
}

}  // namespace

std::vector<fs::path> files_of_bag(const fs::path& source) {
    std::error_code error;
    if (fs::is_directory(source, error))
        return fs::exists(source / kMetadata, error) ? files_by_metadata(source)
                                                     : files_by_name(source);
    if (!fs::exists(source, error)) fail(source, "there is no such file or folder.");
    if (!fs::is_regular_file(source, error)) fail(source, "this is neither a file nor a folder.");
    if (source.extension() == ".bag")
        fail(source, "bags of ROS 1 are not read. `rosbags-convert` makes a ROS 2 bag of one.");
    return {source};
}

std::vector<BagTopic> topics_of_bag(const std::vector<fs::path>& files) {
    std::vector<BagTopic> topics;
    for (const fs::path& file : files)
        for (const BagTopic& topic :
             is_sqlite(file) ? topics_of_sqlite_bag(file) : topics_of_mcap(file))
            add_topic(topic, topics);
    return topics;
}

BagMessages::BagMessages(std::vector<fs::path> files)
    : files_(std::move(files)), reader_(open_reader(files_.front())) {}

bool BagMessages::next(BagMessage& message) {
    try {
        while (fault_.empty() && !reader_->next(message)) {
            fault_ = reader_->fault();
            if (!fault_.empty() || position_ + 1 == files_.size()) return false;
            reader_ = open_reader(files_[++position_]);
        }
    } catch (const CliError& error) {
        fault_ = error.what();
    }
    return fault_.empty();
}

}  // namespace defrec::cli
