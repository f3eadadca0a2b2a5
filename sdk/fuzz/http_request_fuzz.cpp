// Requests to the live view: nothing is read beyond them, a request is whole once, and its parts
// are within what came.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "sdk/live_view/http_request.hpp"

using defrec::cli::HttpReading;
using defrec::cli::HttpRequest;
using defrec::cli::read_request;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view bytes(reinterpret_cast<const char*>(data), size);
    HttpRequest request;
    const HttpReading reading = read_request(bytes, request);
    if ((reading.kind == HttpReading::Kind::kRefused) != (reading.reason != nullptr)) std::abort();
    if (reading.kind != HttpReading::Kind::kWhole) return 0;
    if (reading.size > size || reading.size == 0 || request.host.size() > reading.size ||
        request.content.size() > defrec::cli::kMaxContent)
        std::abort();
    static_cast<void>(request.parameter("token"));
    // However it comes in pieces, it ends at the same place.
    HttpRequest again;
    for (const std::size_t cut : {reading.size - 1, reading.size / 2})
        if (read_request(bytes.substr(0, cut), again).kind == HttpReading::Kind::kWhole)
            std::abort();
    const HttpReading alone = read_request(bytes.substr(0, reading.size), again);
    if (alone.kind != HttpReading::Kind::kWhole || alone.size != reading.size ||
        again.content != request.content || again.host != request.host)
        std::abort();
    return 0;
}
