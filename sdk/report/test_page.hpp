// For tests of the page: what is in the file, and the page in a real browser (Chromium, headless).
#pragma once

#include <filesystem>
#include <string>

namespace defrec::cli::test {

std::string read_page(const std::filesystem::path& path);

/// Whether the page is of a build without npm, as web/plain_page.py writes it.
bool is_plain(const std::string& page);

bool have_chromium();

/// The page's document after its script ran, which must have met no error.
/// Folder: empty, for the browser's profile and output.
std::string browse(const std::filesystem::path& page, const std::filesystem::path& folder);

}  // namespace defrec::cli::test
