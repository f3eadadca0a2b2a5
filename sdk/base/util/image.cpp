// See image.hpp. Sizes are computed in 64 bits and checked before they are used.
#include "sdk/base/util/image.hpp"

#include "sdk/base/util/error.hpp"
#include "sdk/base/util/struct_size.hpp"
#include "sdk/contract/pixel_format.hpp"

namespace defrec {

defrec_image read_image(const char* what, const defrec_image* given) {
    defrec_image image = read_struct<defrec_image>(what, given);
    const uint32_t pixel = bytes_per_pixel(image.format);
    if (pixel == 0) fail(DEFREC_ERROR_ARGUMENT, what, ": unknown format ", image.format);
    if (image.width < DEFREC_MIN_WIDTH || image.height < DEFREC_MIN_HEIGHT ||
        image.width > DEFREC_MAX_SIDE || image.height > DEFREC_MAX_SIDE)
        fail(DEFREC_ERROR_ARGUMENT, what, ": ", image.width, " x ", image.height, " pixels given, ",
             int{DEFREC_MIN_WIDTH}, " x ", int{DEFREC_MIN_HEIGHT}, " to ", int{DEFREC_MAX_SIDE},
             " x ", int{DEFREC_MAX_SIDE}, " expected");
    const uint64_t row = uint64_t{image.width} * pixel;
    if (image.stride == 0 && image.memory == nullptr) image.stride = row;
    if (image.stride != 0 && image.stride < row)
        fail(DEFREC_ERROR_ARGUMENT, what, ": stride is ", image.stride, " bytes, a row of ",
             image.width, " pixels has ", row);
    if (image.stride > UINT32_MAX)
        fail(DEFREC_ERROR_ARGUMENT, what, ": stride is ", image.stride,
             " bytes, more than 32 bits");
    if (image.memory != nullptr) {
        if (image.pixels != nullptr)
            fail(DEFREC_ERROR_ARGUMENT, what, ": both pixels and memory are given");
        return image;
    }
    if (image.pixels == nullptr) fail(DEFREC_ERROR_ARGUMENT, what, ": pixels is NULL");
    if (reinterpret_cast<uintptr_t>(image.pixels) > UINTPTR_MAX - image_bytes(image))
        fail(DEFREC_ERROR_ARGUMENT, what, ": the pixels do not fit into the address space");
    return image;
}

uint64_t image_bytes(const defrec_image& image) {
    return image.stride * (image.height - 1) +
           uint64_t{image.width} * bytes_per_pixel(image.format);
}

void expect_image(const char* what, const defrec_image& image, uint32_t width, uint32_t height,
                  uint32_t format) {
    if (image.width != width || image.height != height)
        fail(DEFREC_ERROR_ARGUMENT, what, ": ", image.width, " x ", image.height,
             " pixels given, the rig has ", width, " x ", height);
    if (image.format != format)
        fail(DEFREC_ERROR_ARGUMENT, what, ": format ", image.format, " given, ", format,
             " expected");
}

}  // namespace defrec
