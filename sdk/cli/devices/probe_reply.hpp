// What the process that opens a plugin tells the one that started it: one line of JSON.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace defrec::cli {

struct ProbeReply {
    bool is_good = false;
    std::string message;               // what is wrong; when good, what was tried
    std::vector<std::string> devices;  // ids
    bool operator==(const ProbeReply&) const = default;
};

// Without the end of the line. What is no UTF-8 is replaced.
std::string write_probe_reply(const ProbeReply& reply);
// Empty where the text is none: the plugin's code may have written it.
std::optional<ProbeReply> read_probe_reply(std::string_view text);

}  // namespace defrec::cli
