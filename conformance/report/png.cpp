#include "conformance/report/png.hpp"

#include <png.h>

#include "conformance/report/report.hpp"

namespace defrec::conformance {

std::vector<uint8_t> png_of(const Picture& picture) {
    const uint64_t expected = uint64_t{picture.width} * picture.height * 3;
    if (expected == 0 || picture.pixels.size() != expected)
        throw ReportError("the picture '" + picture.title + "' has " +
                          std::to_string(picture.pixels.size()) + " bytes, " +
                          std::to_string(picture.width) + "x" + std::to_string(picture.height) +
                          " RGB pixels need " + std::to_string(expected));
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = picture.width;
    image.height = picture.height;
    image.format = PNG_FORMAT_RGB;
    png_alloc_size_t size = 0;
    std::vector<uint8_t> bytes;
    bool written =
        png_image_write_get_memory_size(image, size, 0, picture.pixels.data(), 0, nullptr) != 0;
    if (written) {
        bytes.resize(size);
        written = png_image_write_to_memory(&image, bytes.data(), &size, 0, picture.pixels.data(),
                                            0, nullptr) != 0;
        bytes.resize(size);
    }
    if (!written)
        throw ReportError("the picture '" + picture.title +
                          "' cannot be encoded: " + image.message);
    return bytes;
}

}  // namespace defrec::conformance
