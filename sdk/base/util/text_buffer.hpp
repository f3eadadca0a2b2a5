// An error message in fixed memory, so that keeping it cannot fail.
#pragma once
#include <cstddef>
#include <cstring>
#include <string_view>

namespace defrec {

template <size_t kCapacity>
class TextBuffer {
  public:
    // Cuts what does not fit, never inside a UTF-8 character.
    void set(std::string_view text) noexcept {
        size_t size = text.size() < kCapacity ? text.size() : kCapacity - 1;
        if (size < text.size())
            while (size > 0 && (static_cast<unsigned char>(text[size]) & 0xC0) == 0x80) --size;
        std::memcpy(text_, text.data(), size);
        text_[size] = '\0';
    }
    const char* text() const noexcept { return text_; }
    bool empty() const noexcept { return text_[0] == '\0'; }

  private:
    char text_[kCapacity] = {};
};

}  // namespace defrec
