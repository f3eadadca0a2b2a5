// Topics and messages of a bag's file, whatever its format.
#pragma once

#include <cstdint>
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

// Messages in the order in which they were written. One thread at a time.
class BagReader {
  public:
    virtual ~BagReader() = default;

    // False at the end, and where the file is cut off or damaged; fault() then says so.
    virtual bool next(BagMessage& message) = 0;
    virtual const std::string& fault() const = 0;
};

// Adds to `topics`, counts to those that are there.
void add_topic(const BagTopic& topic, std::vector<BagTopic>& topics);

}  // namespace defrec::cli
