// Where the live link connects to or listens.
#include "sdk/live_link/endpoint.hpp"

#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

constexpr std::int64_t kHighestPort = 65535;

std::uint16_t parse_port(const std::string& text, std::string_view port, std::int64_t lowest) {
    const auto value = parse_integer(port);
    if (!value || *value < lowest || *value > kHighestPort) {
        throw CliError(ExitCode::kUsage,
                       "'" + text + "' needs a port from " + std::to_string(lowest) + " to " +
                           std::to_string(kHighestPort) + " at its end (3D Slicer's is 18944).");
    }
    return static_cast<std::uint16_t>(*value);
}

std::string parse_host(const std::string& text, std::string_view host) {
    const bool is_bracketed = host.size() > 2 && host.front() == '[' && host.back() == ']';
    if (is_bracketed) return std::string(host.substr(1, host.size() - 2));
    if (host.empty() || host.find_first_of(":[]") != std::string_view::npos) {
        throw CliError(
            ExitCode::kUsage,
            "'" + text + "' is not HOST:PORT; an IPv6 address stands in brackets, [::1]:18944.");
    }
    return std::string(host);
}

}  // namespace

Endpoint parse_target(const std::string& text) {
    const std::size_t colon = text.rfind(':');
    if (colon == std::string::npos)
        throw CliError(ExitCode::kUsage, "'" + text + "' is not HOST:PORT.");
    const std::string_view whole = text;
    return {parse_host(text, whole.substr(0, colon)), parse_port(text, whole.substr(colon + 1), 1)};
}

Endpoint parse_listener(const std::string& text) {
    const std::size_t colon = text.rfind(':');
    if (colon == std::string::npos) return {"127.0.0.1", parse_port(text, text, 0)};
    const std::string_view whole = text;
    return {parse_host(text, whole.substr(0, colon)), parse_port(text, whole.substr(colon + 1), 0)};
}

std::string to_string(const Endpoint& endpoint) {
    const bool is_ipv6 = endpoint.host.find(':') != std::string::npos;
    return (is_ipv6 ? "[" + endpoint.host + "]" : endpoint.host) + ":" +
           std::to_string(endpoint.port);
}

}  // namespace defrec::cli
