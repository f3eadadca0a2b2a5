// See browser.hpp.
#include "sdk/cli/commands/browser.hpp"

#include <cstdlib>
#include <string>

namespace defrec::cli {
namespace {

// xdg-open says by its exit code that it found no browser, and may run as long as the browser does:
// what still runs after a second has opened the page.
constexpr const char* kOpener =
    "command -v xdg-open >/dev/null 2>&1 || exit 1; "
    "xdg-open \"$page\" >/dev/null 2>&1 & opener=$!; "
    "for step in 1 2 3 4 5 6 7 8 9 10; do "
    "sleep 0.1; kill -0 $opener 2>/dev/null || { wait $opener; exit; }; done";

bool has_screen() {
    return std::getenv("DISPLAY") != nullptr || std::getenv("WAYLAND_DISPLAY") != nullptr;
}

}  // namespace

Opened open_in_browser(const std::filesystem::path& page) {
    if (!has_screen()) return Opened::kNoScreen;
    std::string quoted;
    for (const char c : page.string()) quoted += c == '\'' ? std::string("'\\''") : std::string{c};
    return std::system(("page='" + quoted + "'; " + kOpener).c_str()) == 0 ? Opened::kYes
                                                                           : Opened::kNoBrowser;
}

}  // namespace defrec::cli
