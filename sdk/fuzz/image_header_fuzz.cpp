// The first bytes of an image or a video.
#include "sdk/io/image_header.hpp"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static_cast<void>(defrec::cli::image_header_size({data, size}));
    static_cast<void>(defrec::cli::begins_video({data, size}));
    return 0;
}
