// See probe_reply.hpp.
#include "sdk/cli/devices/probe_reply.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace defrec::cli {

std::string write_probe_reply(const ProbeReply& reply) {
    const nlohmann::json json{
        {"good", reply.is_good}, {"message", reply.message}, {"devices", reply.devices}};
    return json.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
}

std::optional<ProbeReply> read_probe_reply(std::string_view text) {
    const auto json = nlohmann::json::parse(text, nullptr, false);
    if (!json.is_object() || !json.contains("good") || !json["good"].is_boolean() ||
        !json.contains("message") || !json["message"].is_string() || !json.contains("devices") ||
        !json["devices"].is_array())
        return std::nullopt;
    const auto& devices = json["devices"];
    if (!std::all_of(devices.begin(), devices.end(),
                     [](const nlohmann::json& device) { return device.is_string(); }))
        return std::nullopt;
    return ProbeReply{json["good"].get<bool>(), json["message"].get<std::string>(),
                      devices.get<std::vector<std::string>>()};
}

}  // namespace defrec::cli
