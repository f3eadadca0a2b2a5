// Files of the library's own layouts, templates and plans: eight bytes that name the kind, the
// layout's number, values and arrays one after the other, a checksum. Little endian.
#pragma once
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "sdk/base/util/error.hpp"

namespace defrec {

static_assert(std::endian::native == std::endian::little, "a file's layout is the memory's");

struct BinaryFileKind {
    const char* name;  // "template"
    std::array<char, 8> magic;
    uint32_t layout;     // grows with every change of the file
    uint64_t max_bytes;  // of a file
};

class BinaryWriter {
  public:
    explicit BinaryWriter(const BinaryFileKind& kind) : kind_(kind) {
        value(kind.magic);
        value(kind.layout);
    }
    template <class T>
    void value(const T& value) {
        static_assert(std::is_trivially_copyable_v<T>);
        bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
    }
    template <class T>
    void array(std::span<const T> values) {
        static_assert(std::is_trivially_copyable_v<T>);
        value(static_cast<uint64_t>(values.size()));
        bytes_.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
    }
    template <class T>
    void array(const std::vector<T>& values) {
        array(std::span<const T>(values));
    }
    void text(const std::string& text) { array(std::span<const char>(text)); }
    // With the checksum, whole or not at all. Throws Error(DEFREC_ERROR_IO).
    void save(const char* path) const;

  private:
    const BinaryFileKind& kind_;
    std::string bytes_;
};

class BinaryReader {
  public:
    // Reads the file, and its kind and layout. Throws Error(DEFREC_ERROR_IO) for what is no such
    // file, Error(DEFREC_ERROR_VERSION) for another layout.
    BinaryReader(const BinaryFileKind& kind, const char* path);

    template <class T>
    void value(T& value) {
        need(sizeof value);
        std::memcpy(&value, bytes_.data() + at_, sizeof value);
        at_ += sizeof value;
    }
    template <class T>
    void array(std::vector<T>& values) {
        uint64_t count = 0;
        value(count);
        if (count > (bytes_.size() - at_) / sizeof(T)) broken("it ends too early");
        values.resize(count);
        if (count == 0) return;  // no data(), which memcpy would mind
        std::memcpy(values.data(), bytes_.data() + at_, count * sizeof(T));
        at_ += count * sizeof(T);
    }
    std::string text() {
        std::vector<char> letters;
        array(letters);
        return {letters.begin(), letters.end()};
    }
    bool flag() {
        uint8_t flag = 0;
        value(flag);
        if (flag > 1) broken("a flag is out of range");
        return flag != 0;
    }
    // Nothing but the checksum is left, and it fits.
    void expect_end();
    const std::string& path() const { return path_; }
    [[noreturn]] void broken(const char* why) const {
        fail(DEFREC_ERROR_IO, path_, " is not a usable ", kind_.name, ": ", why);
    }

  private:
    void need(size_t count) const {
        if (bytes_.size() - at_ < count) broken("it ends too early");
    }
    const BinaryFileKind& kind_;
    std::string path_, bytes_;
    size_t at_ = 0;
};

}  // namespace defrec
