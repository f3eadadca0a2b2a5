// See view_packet.hpp.
#include "sdk/live_view/view_packet.hpp"

#include <bit>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "sdk/io/json_text.hpp"

namespace defrec::cli {
namespace {

static_assert(std::endian::native == std::endian::little, "the page reads little-endian arrays");

void fill_up(std::string& text, char with) { text.resize((text.size() + 3) / 4 * 4, with); }

}  // namespace

std::string ViewPacket::body(std::string_view header) const {
    nlohmann::ordered_json json = nlohmann::ordered_json::parse(header);
    json["sections"] = nlohmann::ordered_json::array();
    for (const auto& [name, bytes] : sections_) json["sections"].push_back({name, bytes.size()});
    std::string text = json_text(json);
    fill_up(text, ' ');
    const auto length = static_cast<std::uint32_t>(text.size());
    std::string body(reinterpret_cast<const char*>(&length), sizeof length);
    body += text;
    for (const auto& section : sections_) {
        body += section.second;
        fill_up(body, '\0');
    }
    return body;
}

}  // namespace defrec::cli
