// The live view's page: HTML, style and script, made of web/ at build time.
#pragma once

#include <span>
#include <string_view>

namespace defrec::cli {

/// Pieces to be written one after the other.
std::span<const std::string_view> live_page();

}  // namespace defrec::cli
