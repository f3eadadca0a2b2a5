// The page around the data: HTML, style and script, made of web/ at build time. web/embed_page.py
// writes the definitions.
#pragma once

#include <span>
#include <string_view>

namespace defrec::cli {

/// Pieces to be written one after the other before and after the data (JSON inside a script
/// element).
std::span<const std::string_view> page_before_data();
std::span<const std::string_view> page_after_data();

}  // namespace defrec::cli
