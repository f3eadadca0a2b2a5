// See ros_messages.hpp.
#include "sdk/bag/ros_messages.hpp"

#include <bit>
#include <cstddef>

namespace defrec::cli {
namespace {

// Values of a message in their order, each at a multiple of its size, counted from behind the four
// bytes that name the representation. What is not there is 0 or empty, and has_failed() says so
// from then on.
class CdrReader {
  public:
    explicit CdrReader(ByteView message) : body_(ByteView()) {
        constexpr std::size_t kHead = 4;
        constexpr unsigned char kBigEndian = 0, kLittleEndian = 1;
        has_failed_ = message.size() < kHead || message[0] != 0 ||
                      (message[1] != kBigEndian && message[1] != kLittleEndian);
        if (has_failed_) return;
        is_big_ = message[1] == kBigEndian;
        body_ = message.subspan(kHead);
    }

    bool has_failed() const { return has_failed_; }

    std::uint8_t byte() { return static_cast<std::uint8_t>(number(1)); }
    std::uint32_t unsigned32() { return static_cast<std::uint32_t>(number(4)); }
    std::int32_t signed32() { return static_cast<std::int32_t>(unsigned32()); }
    double real() { return std::bit_cast<double>(number(8)); }
    template <std::size_t kCount>
    void reals(std::array<double, kCount>& values) {
        for (double& value : values) value = real();
    }
    std::vector<double> list_of_reals() {
        const std::uint32_t count = unsigned32();
        has_failed_ = has_failed_ || count > (body_.size() - at_) / sizeof(double);
        std::vector<double> values(has_failed_ ? 0 : count);
        for (double& value : values) value = real();
        return values;
    }
    ByteView list_of_bytes() { return bytes(unsigned32()); }
    // It ends with a zero byte.
    std::string_view text() {
        const ByteView taken = list_of_bytes();
        has_failed_ = has_failed_ || (!taken.empty() && taken.back() != 0);
        if (has_failed_ || taken.empty()) return {};
        return {reinterpret_cast<const char*>(taken.data()), taken.size() - 1};
    }

  private:
    std::uint64_t number(std::size_t size) {
        at_ = (at_ + size - 1) / size * size;
        std::uint64_t value = 0;
        const ByteView taken = bytes(size);
        for (std::size_t i = 0; i < taken.size(); ++i)
            value = value << 8 | taken[is_big_ ? i : size - 1 - i];
        return value;
    }
    ByteView bytes(std::size_t count) {
        has_failed_ = has_failed_ || at_ > body_.size() || count > body_.size() - at_;
        if (has_failed_) {
            at_ = body_.size();
            return {};
        }
        const ByteView taken = body_.subspan(at_, count);
        at_ += count;
        return taken;
    }

    ByteView body_;
    std::size_t at_ = 0;
    bool is_big_ = false, has_failed_ = false;
};

// The stamp of a std_msgs/msg/Header.
std::int64_t read_header(CdrReader& reader) {
    constexpr std::int64_t kNanosecondsInSecond = 1'000'000'000;
    const std::int64_t seconds = reader.signed32();
    const std::int64_t stamp = seconds * kNanosecondsInSecond + reader.unsigned32();
    static_cast<void>(reader.text());  // frame_id
    return stamp;
}

template <class Message>
std::optional<Message> unless_failed(const CdrReader& reader, const Message& message) {
    return reader.has_failed() ? std::nullopt : std::optional(message);
}

}  // namespace

std::optional<RosImage> read_image(ByteView message) {
    CdrReader reader(message);
    RosImage image;
    image.stamp_ns = read_header(reader);
    image.height = reader.unsigned32();
    image.width = reader.unsigned32();
    image.encoding = reader.text();
    static_cast<void>(reader.byte());  // is_bigendian, which says nothing of single bytes
    image.step = reader.unsigned32();
    image.pixels = reader.list_of_bytes();
    return unless_failed(reader, image);
}

std::optional<RosCompressedImage> read_compressed_image(ByteView message) {
    CdrReader reader(message);
    RosCompressedImage image;
    image.stamp_ns = read_header(reader);
    image.format = reader.text();
    image.bytes = reader.list_of_bytes();
    return unless_failed(reader, image);
}

std::optional<RosCameraInfo> read_camera_info(ByteView message) {
    CdrReader reader(message);
    RosCameraInfo info;
    static_cast<void>(read_header(reader));
    info.height = reader.unsigned32();
    info.width = reader.unsigned32();
    info.distortion_model = reader.text();
    info.d = reader.list_of_reals();
    reader.reals(info.k);
    reader.reals(info.r);
    reader.reals(info.p);
    info.binning_x = reader.unsigned32();
    info.binning_y = reader.unsigned32();
    info.roi_x = reader.unsigned32();
    info.roi_y = reader.unsigned32();
    info.roi_height = reader.unsigned32();
    info.roi_width = reader.unsigned32();
    return unless_failed(reader, info);
}

}  // namespace defrec::cli
