// The rule of struct_size (head of include/defrec_c.h): how a struct of another version is read and
// written.
#pragma once
#include <algorithm>
#include <cstring>

#include "sdk/base/util/error.hpp"

namespace defrec {

inline constexpr uint32_t kLargestStruct = 65536;

// Checks a struct_size that the caller wrote. what names the struct: "desc".
inline uint32_t checked_struct_size(const char* what, const void* given) {
    if (given == nullptr) fail(DEFREC_ERROR_ARGUMENT, what, " is NULL");
    uint32_t size;
    std::memcpy(&size, given, sizeof size);
    if (size < sizeof size || size > kLargestStruct)
        fail(DEFREC_ERROR_VERSION, what, ": struct_size is ", size, "; use DEFREC_INIT");
    return size;
}

// The caller's struct as this library knows it: missing fields zero, an unknown tail refused unless
// it is zero.
template <class Struct>
Struct read_struct(const char* what, const void* given) {
    const uint32_t size = checked_struct_size(what, given);
    const auto* bytes = static_cast<const unsigned char*>(given);
    const auto is_zero = [](unsigned char byte) { return byte == 0; };
    if (size > sizeof(Struct) && !std::all_of(bytes + sizeof(Struct), bytes + size, is_zero))
        fail(DEFREC_ERROR_VERSION, what,
             " uses fields that this library does not know: struct_size is ", size, ", known are ",
             sizeof(Struct), " bytes");
    Struct result{};
    std::memcpy(static_cast<void*>(&result), given, std::min<size_t>(size, sizeof result));
    result.struct_size = sizeof result;
    return result;
}

// Writes as many bytes as both sides know; the caller's struct_size stays.
template <class Struct>
void write_struct(Struct* out, const Struct& value) {
    const uint32_t size = checked_struct_size("out", out);
    auto* bytes = reinterpret_cast<unsigned char*>(out);
    const auto* from = reinterpret_cast<const unsigned char*>(&value);
    const size_t head = sizeof value.struct_size;
    std::memcpy(bytes + head, from + head, std::min<size_t>(size, sizeof value) - head);
}

}  // namespace defrec
