// What worker and runner tell each other: plain values as bytes, for a pipe between processes of
// one program.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "conformance/worker/record.hpp"

namespace defrec::conformance {

// What one repetition of one case gave.
struct RunResult {
    Verdict verdict = Verdict::passed;
    std::string reason;
    std::vector<Metric> metrics;
    std::vector<Picture> pictures;
    uint64_t digest = 0;
    double seconds = 0;
};

// Who answers; of the plugin's table and its device.
struct DeviceDescription {
    std::string plugin_vendor, id, name, driver;
    uint32_t kind = 0, features = 0, stages = 0;
};

enum class MessageKind : uint8_t {
    ready,    // device: the plugins are loaded
    refused,  // text: why the plugin or its device cannot be examined
    began,    // step
    ended     // step, result
};

struct Message {
    MessageKind kind = MessageKind::refused;
    uint64_t step = 0;
    std::string text;
    DeviceDescription device;
    RunResult result;
};

std::vector<unsigned char> encode(const Message& message);
// Throws Error where the bytes are no message.
Message decode(const std::vector<unsigned char>& bytes);

}  // namespace defrec::conformance
