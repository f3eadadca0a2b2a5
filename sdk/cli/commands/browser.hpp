// A page of this computer, shown by the user's browser.
#pragma once

#include <filesystem>

namespace defrec::cli {

// No browser: none was found, or it ended at once with an error.
enum class Opened { kYes, kNoScreen, kNoBrowser };
Opened open_in_browser(const std::filesystem::path& page);

}  // namespace defrec::cli
