// A request of HTTP/1.1 (RFC 9112), of which the live view understands what browsers send to it,
// and refuses the rest.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace defrec::cli {

inline constexpr std::size_t kMaxHead = 8192;     // bytes up to the empty line
inline constexpr std::size_t kMaxHeaders = 64;    // lines
inline constexpr std::size_t kMaxContent = 1024;  // bytes

struct HttpRequest {
    std::string method, path, query;  // query: without ?
    std::string host, origin, token;  // headers Host, Origin and X-Token; empty without
    std::string content;
    bool keeps_open = true;  // the connection, for another request

    // The query's value for the name; empty where it has none.
    std::string_view parameter(std::string_view name) const;
};

struct HttpReading {
    enum class Kind { kIncomplete, kWhole, kRefused };
    Kind kind = Kind::kIncomplete;
    std::size_t size = 0;          // bytes of the request, where it is whole
    int status = 0;                // of the answer, where it is refused
    const char* reason = nullptr;  // likewise
};

// Reads the request that the bytes begin with. Hosts, origins, tokens and lengths that are given
// twice are refused, and so is what would let two readers disagree on where the request ends.
HttpReading read_request(std::string_view bytes, HttpRequest& request);

}  // namespace defrec::cli
