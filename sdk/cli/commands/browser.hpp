// A page of this computer, shown by the user's browser.
#pragma once

#include <filesystem>

namespace defrec::cli {

// False where there is no screen, no browser was found, or it ended at once with an error.
bool open_in_browser(const std::filesystem::path& page);

}  // namespace defrec::cli
