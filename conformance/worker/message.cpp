// See message.hpp. One description of the fields serves both directions.
#include "conformance/worker/message.hpp"

#include <cstring>
#include <type_traits>

#include "sdk/base/util/error.hpp"

namespace defrec::conformance {
namespace {

class Writer {
  public:
    static constexpr bool kReads = false;
    void raw(const void* data, size_t size) {
        const auto* from = static_cast<const unsigned char*>(data);
        bytes.insert(bytes.end(), from, from + size);
    }
    std::vector<unsigned char> bytes;
};

class Reader {
  public:
    static constexpr bool kReads = true;
    explicit Reader(const std::vector<unsigned char>& bytes) : bytes_(bytes) {}
    void raw(void* data, size_t size) {
        if (size > left()) fail(DEFREC_ERROR_INTERNAL, "a message of the worker is cut short");
        if (size != 0) std::memcpy(data, bytes_.data() + at_, size);
        at_ += size;
    }
    size_t left() const { return bytes_.size() - at_; }

  private:
    const std::vector<unsigned char>& bytes_;
    size_t at_ = 0;
};

template <class Stream, class T>
requires std::is_arithmetic_v<T> || std::is_enum_v<T>
void field(Stream& stream, T& value) { stream.raw(&value, sizeof value); }

template <class Stream, class Container>
void bytes_field(Stream& stream, Container& bytes) {
    uint64_t size = bytes.size();
    field(stream, size);
    if constexpr (Stream::kReads) {
        if (size > stream.left())
            fail(DEFREC_ERROR_INTERNAL, "a message of the worker is cut short");
        bytes.resize(size);
    }
    stream.raw(bytes.data(), size);
}
template <class Stream>
void field(Stream& stream, std::string& text) {
    bytes_field(stream, text);
}
template <class Stream>
void field(Stream& stream, std::vector<uint8_t>& bytes) {
    bytes_field(stream, bytes);
}

template <class Stream, class... Values>
void fields(Stream& stream, Values&... values) {
    (field(stream, values), ...);
}

template <class Stream>
void field(Stream& stream, Metric& m) {
    fields(stream, m.name, m.unit, m.maximum, m.p99, m.limit_maximum, m.limit_p99, m.samples);
}
template <class Stream>
void field(Stream& stream, Picture& p) {
    fields(stream, p.title, p.width, p.height, p.pixels);
}

template <class Stream, class T>
void list_field(Stream& stream, std::vector<T>& list) {
    uint64_t count = list.size();
    field(stream, count);
    if constexpr (Stream::kReads) {
        if (count > stream.left())
            fail(DEFREC_ERROR_INTERNAL, "a message of the worker is cut short");
        list.resize(count);
    }
    for (T& item : list) field(stream, item);
}

template <class Stream>
void message_fields(Stream& stream, Message& m) {
    fields(stream, m.kind, m.step, m.text);
    fields(stream, m.device.plugin_vendor, m.device.id, m.device.name, m.device.driver,
           m.device.kind, m.device.features, m.device.stages);
    fields(stream, m.result.verdict, m.result.reason, m.result.digest, m.result.seconds);
    list_field(stream, m.result.metrics);
    list_field(stream, m.result.pictures);
}

}  // namespace

std::vector<unsigned char> encode(const Message& message) {
    Writer writer;
    Message copy = message;
    message_fields(writer, copy);
    return writer.bytes;
}

Message decode(const std::vector<unsigned char>& bytes) {
    Reader reader(bytes);
    Message message;
    message_fields(reader, message);
    if (reader.left() != 0) fail(DEFREC_ERROR_INTERNAL, "a message of the worker is too long");
    return message;
}

}  // namespace defrec::conformance
