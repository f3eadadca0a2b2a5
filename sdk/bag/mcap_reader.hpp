// Messages of an MCAP file (https://mcap.dev/spec), in the order in which they were written. The
// file is read once from front to back, and the memory is that of its largest chunk.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "sdk/bag/byte_reader.hpp"

namespace defrec::cli {

// A topic of one type; of one file, or of all files of a bag.
struct BagTopic {
    std::string name;
    std::string type;      // of its messages: "sensor_msgs/msg/Image"
    std::string encoding;  // of its messages: "cdr"
    std::uint64_t messages = 0;

    bool is_same(const BagTopic& other) const {
        return name == other.name && type == other.type && encoding == other.encoding;
    }
};

struct BagMessage {
    const BagTopic* topic = nullptr;  // as long as the reader; without a count
    ByteView data;                    // until the next message is read
};

// One thread at a time.
class McapReader {
  public:
    // Throws CliError(kInput) for what is no MCAP file or cannot be opened.
    explicit McapReader(const std::filesystem::path& path);
    ~McapReader();
    McapReader(const McapReader&) = delete;
    McapReader& operator=(const McapReader&) = delete;

    // False at the end, and where the file is cut off or damaged; fault() then says so.
    bool next(BagMessage& message);
    const std::string& fault() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

// By the file's summary, or where it has none by its messages, up to where it is cut off or
// damaged. Throws like McapReader.
std::vector<BagTopic> topics_of_mcap(const std::filesystem::path& path);

// Adds to `topics`, counts to those that are there.
void add_topic(const BagTopic& topic, std::vector<BagTopic>& topics);

}  // namespace defrec::cli
