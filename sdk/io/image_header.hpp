// What a file says of itself in its first bytes, before anything decodes it.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace defrec::cli {

struct HeaderSize {
    std::uint64_t width = 0, height = 0;  // px
};

// Size of an image: PNG, JPEG, BMP, TIFF, PNM or WebP; empty for all else, and where the header is
// cut.
std::optional<HeaderSize> image_header_size(std::span<const unsigned char> bytes);

// Whether the bytes begin a container that holds its frames itself: MP4 and MOV, AVI, Matroska and
// WebM, MPEG. Lists that name other files (HLS, concat) are none.
bool begins_video(std::span<const unsigned char> bytes);

}  // namespace defrec::cli
