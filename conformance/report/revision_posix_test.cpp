// WriteRevision.cmake in a repository of its own: what a commit, a change and a copy outside of git
// give, and that an unchanged revision does not touch the header.
#include <doctest/doctest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "conformance/report/revision.hpp"

namespace fs = std::filesystem;

namespace {

void run(const std::string& command) {
    CAPTURE(command);
    REQUIRE(std::system((command + " >/dev/null 2>&1").c_str()) == 0);
}

}  // namespace

TEST_CASE("the header follows the tree") {
    const fs::path root = fs::temp_directory_path() / "defrec_revision_test";
    fs::remove_all(root);
    const fs::path tree = root / "tree", header = root / "revision.hpp";
    fs::create_directories(tree);
    const std::string git =
        "git -C '" + tree.string() + "' -c user.name=a -c user.email=a@b.invalid ";
    const auto value = [&] {
        run("cmake '-DTREE=" + tree.string() + "' '-DHEADER=" + header.string() +
            "' -P '" DEFREC_SOURCE_DIR "/conformance/report/WriteRevision.cmake'");
        std::ifstream file(header);
        return std::string{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    };
    CHECK(value().find("\"unknown\"") != std::string::npos);
    run(git + "init -q");
    std::ofstream(tree / "a") << "1";
    run(git + "add a");
    run(git + "commit -q -m a");
    const std::string clean = value();
    CHECK(clean.find("\"unknown\"") == std::string::npos);
    CHECK(clean.find("DIRTY false") != std::string::npos);
    const auto written = fs::last_write_time(header);
    CHECK(value() == clean);
    CHECK(fs::last_write_time(header) == written);
    std::ofstream(tree / "a") << "2";
    const std::string dirty = value();
    CHECK(dirty.find("DIRTY true") != std::string::npos);
    run(git + "commit -q -a -m b");
    const std::string next = value();
    CHECK(next.find("DIRTY false") != std::string::npos);
    CHECK(next != clean);
    fs::create_directories(tree / "inner");
    run("cmake '-DTREE=" + (tree / "inner").string() + "' '-DHEADER=" + header.string() +
        "' -P '" DEFREC_SOURCE_DIR "/conformance/report/WriteRevision.cmake'");
    std::ifstream file(header);
    const std::string inner{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    CHECK(inner.find("\"unknown\"") != std::string::npos);
    fs::remove_all(root);
}

TEST_CASE("this build's own revision") {
    const std::string id = defrec::conformance::suite_revision().id;
    const bool hash =
        id.size() == 40 && id.find_first_not_of("0123456789abcdef") == std::string::npos;
    CHECK((hash || id == "unknown"));
}
