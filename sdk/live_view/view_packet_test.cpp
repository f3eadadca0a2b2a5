// Packets as the page takes them apart.
#include "sdk/live_view/view_packet.hpp"

#include <doctest/doctest.h>

#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>

using namespace defrec::cli;

TEST_CASE("a packet is a header and sections, each at a multiple of 4 bytes") {
    ViewPacket packet;
    const std::uint8_t status[3] = {0, 1, 2};
    const float xyz[2] = {1.5f, -2};
    packet.add("status", status, 3);
    packet.add("nothing", xyz, 0);
    packet.add("xyz", xyz, 2);
    const std::string body = packet.body(R"({"frame":7})");
    std::uint32_t length = 0;
    std::memcpy(&length, body.data(), 4);
    REQUIRE(length % 4 == 0);
    REQUIRE(body.size() == 4 + length + 4 + 8);
    const auto header = nlohmann::json::parse(body.substr(4, length));
    CHECK(header["frame"] == 7);
    CHECK(header["sections"] == nlohmann::json::parse(R"([["status",3],["nothing",0],["xyz",8]])"));
    CHECK(std::memcmp(&body[4 + length], status, 3) == 0);
    CHECK(std::memcmp(&body[4 + length + 4], xyz, 8) == 0);
}
