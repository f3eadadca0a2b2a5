// Where the live link connects to or listens.
#pragma once

#include <cstdint>
#include <string>

namespace defrec::cli {

struct Endpoint {
    std::string host;  // a name or an address, IPv6 without brackets
    std::uint16_t port = 0;
};

// "HOST:PORT", an IPv6 address in brackets; PORT from 1 to 65535. Throws CliError(kUsage).
Endpoint parse_target(const std::string& text);
// "[ADDRESS:]PORT"; without an address the loopback. PORT 0 is any that is free. Throws
// CliError(kUsage).
Endpoint parse_listener(const std::string& text);

// As it is typed: "localhost:18944", "[::1]:18944".
std::string to_string(const Endpoint& endpoint);

}  // namespace defrec::cli
