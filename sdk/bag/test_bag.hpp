// For tests: writes MCAP files and messages of ROS 2 in CDR.
#pragma once

#ifdef DEFREC_WITH_LZ4
#include <lz4frame.h>
#endif
#ifdef DEFREC_WITH_ZSTD
#include <zstd.h>
#endif

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "sdk/bag/crc32.hpp"
#include "sdk/bag/ros_messages.hpp"

namespace defrec::cli {

// Compressions of chunks that this build can read.
inline std::vector<std::string> compressions() {
    return {
        "",
#ifdef DEFREC_WITH_LZ4
        "lz4",
#endif
#ifdef DEFREC_WITH_ZSTD
        "zstd",
#endif
    };
}

inline ByteView bytes_of(std::string_view text) {
    return {reinterpret_cast<const unsigned char*>(text.data()), text.size()};
}

// Values in either byte order, each at a multiple of its size where they are aligned.
class ByteWriter {
  public:
    enum class Order { kLittle, kBig };
    explicit ByteWriter(Order order = Order::kLittle, bool is_aligned = false)
        : order_(order), is_aligned_(is_aligned) {}

    template <class T>
    requires std::is_unsigned_v<T>
    void number(T value) {
        if (is_aligned_) text.resize((text.size() + sizeof(T) - 1) / sizeof(T) * sizeof(T));
        for (std::size_t i = 0; i < sizeof(T); ++i) {
            const std::size_t byte = order_ == Order::kLittle ? i : sizeof(T) - 1 - i;
            text += static_cast<char>(value >> (8 * byte));
        }
    }
    void real(double value) { number(std::bit_cast<std::uint64_t>(value)); }
    // With its length before it.
    void string(std::string_view bytes) {
        number(static_cast<std::uint32_t>(bytes.size()));
        text += bytes;
    }
    // As CDR has texts: a zero byte ends them.
    void terminated(std::string_view bytes) { string(std::string(bytes) + '\0'); }

    std::string text;

  private:
    Order order_;
    bool is_aligned_;
};

// A message, its header's stamp first.
class CdrWriter : public ByteWriter {
  public:
    explicit CdrWriter(std::int64_t stamp_ns, Order order = Order::kLittle)
        : ByteWriter(order, true), order_of_message_(order) {
        constexpr std::int64_t kSecond = 1'000'000'000;
        number(static_cast<std::uint32_t>(static_cast<std::int32_t>(stamp_ns / kSecond)));
        number(static_cast<std::uint32_t>(stamp_ns % kSecond));
        terminated("camera");
    }
    std::string message() const {
        const char order = order_of_message_ == Order::kLittle ? '\1' : '\0';
        return std::string{'\0', order, '\0', '\0'} + text;
    }

  private:
    Order order_of_message_;
};

struct TestImage {
    std::uint32_t width = 0, height = 0;
    std::string encoding;
    std::uint32_t step = 0;
    std::string pixels;
};

inline std::string image_message(std::int64_t stamp_ns, const TestImage& image,
                                 ByteWriter::Order order = ByteWriter::Order::kLittle) {
    CdrWriter writer(stamp_ns, order);
    writer.number(image.height);
    writer.number(image.width);
    writer.terminated(image.encoding);
    writer.number(std::uint8_t{0});
    writer.number(image.step);
    writer.string(image.pixels);
    return writer.message();
}

inline std::string compressed_message(std::int64_t stamp_ns, std::string_view format,
                                      std::string_view bytes) {
    CdrWriter writer(stamp_ns);
    writer.terminated(format);
    writer.string(bytes);
    return writer.message();
}

inline std::string camera_info_message(const RosCameraInfo& info,
                                       ByteWriter::Order order = ByteWriter::Order::kLittle) {
    CdrWriter writer(0, order);
    writer.number(info.height);
    writer.number(info.width);
    writer.terminated(info.distortion_model);
    writer.number(static_cast<std::uint32_t>(info.d.size()));
    for (const double value : info.d) writer.real(value);
    for (const double value : info.k) writer.real(value);
    for (const double value : info.r) writer.real(value);
    for (const double value : info.p) writer.real(value);
    for (const std::uint32_t value :
         {info.binning_x, info.binning_y, info.roi_x, info.roi_y, info.roi_height, info.roi_width})
        writer.number(value);
    writer.number(std::uint8_t{0});
    return writer.message();
}

class McapWriter {
  public:
    struct Options {
        std::string compression;   // "", "lz4" or "zstd"
        std::size_t messages = 2;  // in a chunk; 0: there are no chunks
        bool has_summary = true, has_crc = true;
    };

    McapWriter() : McapWriter(Options()) {}
    explicit McapWriter(Options options) : options_(std::move(options)) {
        text_ = kMagic;
        ByteWriter header;
        header.string("ros2");
        header.string("test");
        append(text_, 0x01, header.text);
    }

    std::uint16_t add_channel(std::string_view topic, std::string_view type,
                              std::string_view encoding = "cdr") {
        const auto id = static_cast<std::uint16_t>(counts_.size() + 1);
        counts_[id] = 0;
        ByteWriter schema, channel;
        schema.number(id);
        schema.string(type);
        schema.string("ros2msg");
        schema.string("");
        channel.number(id);
        channel.number(id);
        channel.string(topic);
        channel.string(encoding);
        channel.string("");
        std::string& out = options_.messages > 0 ? chunk_ : text_;
        for (std::string* text : {&out, &summary_}) {
            append(*text, 0x03, schema.text);
            append(*text, 0x04, channel.text);
        }
        return id;
    }

    void add(std::uint16_t channel, std::string_view data) {
        ByteWriter message;
        message.number(channel);
        message.number(static_cast<std::uint32_t>(counts_[channel]++));
        message.number(std::uint64_t{1});
        message.number(std::uint64_t{1});
        message.text += data;
        append(options_.messages > 0 ? chunk_ : text_, 0x05, message.text);
        if (++in_chunk_ >= options_.messages) end_chunk();
    }

    // The file's bytes.
    std::string finish() {
        end_chunk();
        // A record that readers pass over.
        append(text_, 0x0C, std::string(100, 'x'));
        ByteWriter data_end;
        data_end.number(options_.has_crc ? crc32(bytes_of(text_)) : 0U);
        append(text_, 0x0F, data_end.text);
        const auto begin = static_cast<std::uint64_t>(text_.size());
        ByteWriter statistics, counts;
        statistics.text.resize(8 + 2 + 4 * 4 + 2 * 8);
        for (const auto& [id, count] : counts_) {
            counts.number(id);
            counts.number(count);
        }
        statistics.string(counts.text);
        append(summary_, 0x0B, statistics.text);
        append(summary_, 0x08, std::string(50, 'x'));
        ByteWriter footer;
        footer.text = '\x02';
        footer.number(std::uint64_t{20});
        footer.number(options_.has_summary ? begin : 0);
        footer.number(std::uint64_t{0});
        const std::string end = (options_.has_summary ? summary_ : "") + footer.text;
        ByteWriter crc;
        crc.number(options_.has_crc ? crc32(bytes_of(end)) : 0U);
        return text_ + end + crc.text + std::string(kMagic);
    }

    static void append(std::string& out, char opcode, std::string_view content) {
        ByteWriter length;
        length.number(static_cast<std::uint64_t>(content.size()));
        out += opcode;
        out += length.text;
        out += content;
    }

  private:
    static constexpr std::string_view kMagic = "\x89MCAP0\r\n";

    std::string packed() const {
#ifdef DEFREC_WITH_LZ4
        if (options_.compression == "lz4") {
            std::string out(LZ4F_compressFrameBound(chunk_.size(), nullptr), '\0');
            const std::size_t size =
                LZ4F_compressFrame(out.data(), out.size(), chunk_.data(), chunk_.size(), nullptr);
            if (LZ4F_isError(size) != 0) throw std::runtime_error("lz4");
            return out.substr(0, size);
        }
#endif
#ifdef DEFREC_WITH_ZSTD
        if (options_.compression == "zstd") {
            std::string out(ZSTD_compressBound(chunk_.size()), '\0');
            const std::size_t size =
                ZSTD_compress(out.data(), out.size(), chunk_.data(), chunk_.size(), 1);
            if (ZSTD_isError(size) != 0) throw std::runtime_error("zstd");
            return out.substr(0, size);
        }
#endif
        return chunk_;
    }

    void end_chunk() {
        in_chunk_ = 0;
        if (chunk_.empty()) return;
        ByteWriter chunk;
        chunk.text.resize(16);
        chunk.number(static_cast<std::uint64_t>(chunk_.size()));
        chunk.number(options_.has_crc ? crc32(bytes_of(chunk_)) : 0U);
        chunk.string(options_.compression);
        const std::string content = packed();
        chunk.number(static_cast<std::uint64_t>(content.size()));
        chunk.text += content;
        append(text_, 0x06, chunk.text);
        append(text_, 0x07, std::string(30, 'x'));
        chunk_.clear();
    }

    const Options options_;
    std::string text_, chunk_, summary_;
    std::size_t in_chunk_ = 0;
    std::map<std::uint16_t, std::uint64_t> counts_;
};

}  // namespace defrec::cli
