// Texts of others: whether they are UTF-8, and how a message shows them.
#pragma once
#include <cstddef>
#include <string>
#include <string_view>

namespace defrec {

// By the Unicode Standard, table 3-7: nothing that is longer than it need be, no surrogates.
inline bool is_utf8(std::string_view text) {
    for (std::size_t i = 0; i < text.size();) {
        const auto byte = [&](std::size_t k) {
            return i + k < text.size() ? static_cast<unsigned char>(text[i + k]) : 0u;
        };
        const unsigned first = byte(0), second = byte(1);
        if (first < 0x80) {
            ++i;
            continue;
        }
        const std::size_t more = first < 0xC2 ? 0 : first < 0xE0 ? 1 : first < 0xF0 ? 2 : 3;
        if (more == 0 || first > 0xF4) return false;
        const unsigned low = first == 0xE0 ? 0xA0u : first == 0xF0 ? 0x90u : 0x80u;
        const unsigned high = first == 0xED ? 0x9Fu : first == 0xF4 ? 0x8Fu : 0xBFu;
        if (second < low || second > high) return false;
        for (std::size_t k = 2; k <= more; ++k)
            if (byte(k) < 0x80 || byte(k) > 0xBF) return false;
        i += 1 + more;
    }
    return true;
}

// UTF-8 with '?' for what terminals obey: the controls, U+0080 to U+009F among them.
inline std::string without_controls(std::string_view text) {
    std::string shown;
    for (const char each : text) {
        const auto byte = static_cast<unsigned char>(each);
        const bool is_c1 = !shown.empty() && shown.back() == '\xC2' && byte < 0xA0;
        if (is_c1) shown.pop_back();
        shown += byte < 0x20 || byte == 0x7F || is_c1 ? '?' : each;
    }
    return shown;
}

}  // namespace defrec
