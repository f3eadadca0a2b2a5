// See image_header.hpp. Formats as their specifications have them: PNG (W3C), JPEG (ITU T.81), BMP
// (Windows), TIFF 6.0, Netpbm, WebP (RFC 9649).
#include "sdk/io/image_header.hpp"

#include <algorithm>
#include <string_view>

namespace defrec::cli {
namespace {

using Bytes = std::span<const unsigned char>;

// Numbers at an offset; 0 beyond the end.
std::uint64_t number(Bytes bytes, std::size_t at, std::size_t size, bool is_big_endian) {
    if (at > bytes.size() || size > bytes.size() - at) return 0;
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < size; ++i)
        value = value << 8 | bytes[at + (is_big_endian ? i : size - 1 - i)];
    return value;
}
std::uint64_t big(Bytes bytes, std::size_t at, std::size_t size) {
    return number(bytes, at, size, true);
}
std::uint64_t little(Bytes bytes, std::size_t at, std::size_t size) {
    return number(bytes, at, size, false);
}

bool holds(Bytes bytes, std::size_t at, std::string_view text) {
    return at <= bytes.size() && text.size() <= bytes.size() - at &&
           std::equal(text.begin(), text.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at),
                      [](char a, unsigned char b) { return static_cast<unsigned char>(a) == b; });
}

std::optional<HeaderSize> known(std::uint64_t width, std::uint64_t height) {
    if (width == 0 || height == 0) return std::nullopt;
    return HeaderSize{width, height};
}

std::optional<HeaderSize> jpeg_size(Bytes bytes) {
    for (std::size_t at = 2; at + 4 <= bytes.size();) {
        if (bytes[at] != 0xFF) return std::nullopt;
        const unsigned char marker = bytes[at + 1];
        if (marker == 0xFF) {  // fill
            ++at;
            continue;
        }
        const bool is_frame =
            marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
        if (is_frame) return known(big(bytes, at + 7, 2), big(bytes, at + 5, 2));
        const std::uint64_t length = big(bytes, at + 2, 2);
        if (length < 2) return std::nullopt;
        at += 2 + length;
    }
    return std::nullopt;
}

// A negative height is an image from the top down.
std::optional<HeaderSize> bmp_size(Bytes bytes) {
    const auto side = [&](std::size_t at) -> std::uint64_t {
        const auto value = static_cast<std::int32_t>(little(bytes, at, 4));
        return static_cast<std::uint64_t>(std::abs(static_cast<std::int64_t>(value)));
    };
    if (little(bytes, 14, 4) == 12) return known(little(bytes, 18, 2), little(bytes, 20, 2));
    return known(side(18), side(22));
}

std::optional<HeaderSize> tiff_size(Bytes bytes) {
    const bool is_big = bytes[0] == 'M';
    const std::uint64_t entries = number(bytes, 4, 4, is_big),
                        count = number(bytes, entries, 2, is_big);
    std::uint64_t sides[2] = {0, 0};
    for (std::uint64_t i = 0; i < count; ++i) {
        const std::uint64_t at = entries + 2 + 12 * i, tag = number(bytes, at, 2, is_big);
        if (tag != 256 && tag != 257) continue;
        const bool is_short = number(bytes, at + 2, 2, is_big) == 3;
        sides[tag - 256] = number(bytes, at + 8, is_short ? 2 : 4, is_big);
    }
    return known(sides[0], sides[1]);
}

std::optional<HeaderSize> pnm_size(Bytes bytes) {
    constexpr std::uint64_t kMost = 1'000'000'000'000;
    std::uint64_t sides[2] = {0, 0};
    std::size_t at = 2;
    const auto is_space = [](unsigned char c) { return c == ' ' || (c >= '\t' && c <= '\r'); };
    for (std::uint64_t& side : sides) {
        while (at < bytes.size() && (is_space(bytes[at]) || bytes[at] == '#')) {
            if (bytes[at] == '#')
                while (at < bytes.size() && bytes[at] != '\n') ++at;
            else
                ++at;
        }
        for (; at < bytes.size() && bytes[at] >= '0' && bytes[at] <= '9'; ++at)
            side = std::min(kMost, 10 * side + (bytes[at] - '0'));
        // Decoders differ in where such a number ends.
        if (at < bytes.size() && !is_space(bytes[at])) return std::nullopt;
    }
    return known(sides[0], sides[1]);
}

std::optional<HeaderSize> webp_size(Bytes bytes) {
    if (holds(bytes, 12, "VP8 "))
        return known(little(bytes, 26, 2) & 0x3FFF, little(bytes, 28, 2) & 0x3FFF);
    if (holds(bytes, 12, "VP8L")) {
        const std::uint64_t bits = little(bytes, 21, 4);
        return known((bits & 0x3FFF) + 1, (bits >> 14 & 0x3FFF) + 1);
    }
    if (holds(bytes, 12, "VP8X")) return known(little(bytes, 24, 3) + 1, little(bytes, 27, 3) + 1);
    return std::nullopt;
}

}  // namespace

std::optional<HeaderSize> image_header_size(Bytes bytes) {
    using namespace std::string_view_literals;
    if (holds(bytes, 0, "\x89PNG\r\n\x1A\n"))
        return holds(bytes, 12, "IHDR") ? known(big(bytes, 16, 4), big(bytes, 20, 4))
                                        : std::nullopt;
    if (holds(bytes, 0, "\xFF\xD8")) return jpeg_size(bytes);
    if (holds(bytes, 0, "BM")) return bmp_size(bytes);
    if (holds(bytes, 0, "II*\0"sv) || holds(bytes, 0, "MM\0*"sv)) return tiff_size(bytes);
    if (holds(bytes, 0, "RIFF") && holds(bytes, 8, "WEBP")) return webp_size(bytes);
    if (bytes.size() > 2 && bytes[0] == 'P' && bytes[1] >= '1' && bytes[1] <= '6')
        return pnm_size(bytes);
    return std::nullopt;
}

bool begins_video(Bytes bytes) {
    using namespace std::string_view_literals;
    for (const std::string_view box : {"ftyp"sv, "moov"sv, "mdat"sv, "free"sv, "skip"sv, "wide"sv})
        if (holds(bytes, 4, box)) return true;
    return (holds(bytes, 0, "RIFF") && holds(bytes, 8, "AVI ")) ||
           holds(bytes, 0, "\x1A\x45\xDF\xA3") ||             // Matroska
           holds(bytes, 0, "\0\0\1\xBA"sv) ||                 // MPEG program stream
           holds(bytes, 0, "\0\0\1\xB3"sv) ||                 // MPEG video
           (holds(bytes, 0, "G") && holds(bytes, 188, "G"));  // MPEG transport stream
}

}  // namespace defrec::cli
