// Row 72: on a full disk, and where nothing can be written, the message names the file, and no half
// file is left.
#include "sdk/base/os/atomic_file.hpp"

#include <doctest/doctest.h>

#include <string>

#include "sdk/base/os/test_atomic_file.hpp"

using namespace defrec;
using namespace defrec::test;

TEST_CASE("a file appears when it is committed, and replaces the one before") {
    const TemporaryFolder folder;
    const auto path = folder.path() / "a.csv";
    defrec::test::write_file(path, std::string("old"));
    {
        AtomicFile file(path);
        file.write("new");
        CHECK(text_of(path) == "old");
        file.commit();
    }
    CHECK(text_of(path) == "new");
    { AtomicFile(path).write("dropped"); }
    CHECK(text_of(path) == "new");
    CHECK(files_in(folder.path()) == 1);
}

TEST_CASE("two files on their way to one path do not meet, and files of others stay") {
    const TemporaryFolder folder;
    const auto path = folder.path() / "a.mp4";
    defrec::test::write_file(folder.path() / "a.0.partial.mp4", std::string("mine"));
    AtomicFile first(path), second(path);
    CHECK(first.temporary() != second.temporary());
    CHECK(first.temporary().extension() == ".mp4");
    first.write("first");
    second.write("second");
    second.commit();
    CHECK(text_of(path) == "second");
    first.commit();
    CHECK(text_of(path) == "first");
    CHECK(text_of(folder.path() / "a.0.partial.mp4") == "mine");
    CHECK(files_in(folder.path()) == 2);
}

TEST_CASE("row 72: a place that cannot be written") {
    const TemporaryFolder folder;
    defrec::test::write_file(folder.path() / "file", std::string());
    const auto below = folder.path() / "file" / "a.csv", taken = folder.path() / "taken.csv";
    CHECK(contains(failure_of([&] { write_atomically(below, "x"); }), "cannot be created"));
    std::filesystem::create_directory(taken);
    CHECK(contains(failure_of([&] { write_atomically(taken, "x"); }), "name"));
    CHECK(files_in(folder.path()) == 2);
}

TEST_CASE("row 75: paths are UTF-8") {
    const TemporaryFolder folder;
    const auto path = folder.path() / "größe 肝臓.csv";
    write_atomically(path, "x");
    CHECK(text_of(path) == "x");
}
