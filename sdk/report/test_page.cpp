#include "sdk/report/test_page.hpp"

#include <doctest/doctest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <fstream>
#include <iterator>

namespace defrec::cli::test {
namespace {

void check_ready(const std::string& dom, const std::string& log) {
    CHECK(dom.find("data-ready=\"true\"") != std::string::npos);
    CHECK(dom.find("data-errors=") == std::string::npos);
    // Lines of the page's console carry this mark; warnings of the software renderer do as well.
    for (std::size_t at = log.find(":CONSOLE"); at != std::string::npos;
         at = log.find(":CONSOLE", at + 1)) {
        const std::string line = log.substr(at, log.find('\n', at) - at);
        CAPTURE(line);
        CHECK_FALSE(line.find("Error") != std::string::npos);
        CHECK_FALSE(line.find("Refused") != std::string::npos);
    }
}

}  // namespace

std::string read_page(const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

bool is_plain(const std::string& page) {
    return page.find("<html lang=\"en\" data-plain") != std::string::npos;
}

bool have_chromium() { return std::system("command -v chromium >/dev/null 2>&1") == 0; }

std::string browse(const std::filesystem::path& page, const std::filesystem::path& folder) {
    const std::string command =
        "env -u LD_PRELOAD chromium --headless --no-sandbox --disable-gpu "
        "--use-angle=swiftshader "
        "--enable-unsafe-swiftshader --disable-background-networking --disable-component-update "
        "--disable-sync "
        "--user-data-dir='" +
        (folder / "profile").string() +
        "' --window-size=1200,3000 --virtual-time-budget=20000 "
        "--enable-logging=stderr --dump-dom 'file://" +
        page.string() + "' >'" + (folder / "dom").string() + "' 2>'" + (folder / "log").string() +
        "'";
    const int status = std::system(command.c_str());
    REQUIRE(WIFEXITED(status));
    REQUIRE(WEXITSTATUS(status) == 0);
    const std::string dom = read_page(folder / "dom");
    check_ready(dom, read_page(folder / "log"));
    return dom;
}

}  // namespace defrec::cli::test
