// See decode_image.hpp.
#include "sdk/input/decode_image.hpp"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <string_view>

#include "sdk/io/image_header.hpp"

namespace defrec::cli {
namespace {

// libjpeg fills the rest of a cut file with gray and says nothing; libpng complains on the standard
// error output.
bool is_cut(const std::vector<unsigned char>& bytes) {
    constexpr std::size_t kTail = 65536;
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    const std::string_view tail = text.substr(text.size() - std::min(text.size(), kTail));
    if (text.starts_with("\xFF\xD8")) return tail.find("\xFF\xD9") == std::string_view::npos;
    if (text.starts_with("\x89PNG")) return tail.find("IEND") == std::string_view::npos;
    return false;
}

cv::Mat decode(const std::vector<unsigned char>& bytes, int flags) {
    if (is_cut(bytes)) return {};
    const std::optional<HeaderSize> claimed = image_header_size(bytes);
    if (!claimed || claimed->width > kMaxImageSide || claimed->height > kMaxImageSide) return {};
    try {
        return cv::imdecode(bytes, flags);
    } catch (const cv::Exception&) {
        return {};
    }
}

}  // namespace

cv::Mat decode_image(const std::vector<unsigned char>& bytes) {
    cv::Mat image = decode(bytes, cv::IMREAD_ANYCOLOR | cv::IMREAD_IGNORE_ORIENTATION);
    return image.depth() == CV_8U && (image.channels() == 1 || image.channels() == 3) ? image
                                                                                      : cv::Mat();
}

cv::Mat decode_unchanged(const std::vector<unsigned char>& bytes) {
    return decode(bytes, cv::IMREAD_UNCHANGED);
}

}  // namespace defrec::cli
