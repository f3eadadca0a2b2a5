// Row 72: on a full disk, and where nothing can be written, the message names the file, and no half
// file is left.
#include "sdk/base/atomic_file.hpp"

#include <doctest/doctest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <string>

#include "sdk/base/test_files.hpp"

using namespace defrec;
using defrec::test::TemporaryFolder;

namespace {

std::string text_of(const std::filesystem::path& path) {
    const std::vector<unsigned char> bytes = defrec::test::read_file(path);
    return {bytes.begin(), bytes.end()};
}

template <typename Function>
std::string failure_of(const Function& function) {
    try {
        function();
    } catch (const FileError& error) {
        return error.what();
    }
    return "no failure";
}

bool contains(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

// The kernel refuses to let files grow beyond `bytes`, as a full disk does.
class FileSizeLimit {
  public:
    explicit FileSizeLimit(rlim_t bytes) : handler_(::signal(SIGXFSZ, SIG_IGN)) {
        ::getrlimit(RLIMIT_FSIZE, &before_);
        const rlimit limit{bytes, before_.rlim_max};
        ::setrlimit(RLIMIT_FSIZE, &limit);
    }
    ~FileSizeLimit() {
        ::setrlimit(RLIMIT_FSIZE, &before_);
        ::signal(SIGXFSZ, handler_);
    }
    FileSizeLimit(const FileSizeLimit&) = delete;
    FileSizeLimit& operator=(const FileSizeLimit&) = delete;

  private:
    rlimit before_{};
    void (*handler_)(int);
};

std::size_t files_in(const std::filesystem::path& folder) {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

}  // namespace

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

TEST_CASE("row 72: a full disk") {
    const TemporaryFolder folder;
    std::string message;
    {
        const FileSizeLimit limit(1000);
        message = failure_of(
            [&] { write_atomically(folder.path() / "a.csv", std::string(100'000, 'x')); });
    }
    CHECK_MESSAGE(contains(message, "a.csv"), message);
    CHECK_MESSAGE(contains(message, "space"), message);
    CHECK(files_in(folder.path()) == 0);
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

TEST_CASE("row 85: a link, a FIFO or a folder in a temporary file's place is passed over") {
    const TemporaryFolder folder;
    const auto path = folder.path() / "a.csv", victim = folder.path() / "victim";
    defrec::test::write_file(victim, std::string("mine"));
    std::filesystem::create_symlink(victim, folder.path() / "a.0.partial.csv");
    REQUIRE(::mkfifo((folder.path() / "a.1.partial.csv").c_str(), 0600) == 0);
    std::filesystem::create_directory(folder.path() / "a.2.partial.csv");
    write_atomically(path, "x");
    CHECK(text_of(path) == "x");
    CHECK(text_of(victim) == "mine");
}

TEST_CASE("row 85: a link or a FIFO in the file's own place is replaced, and not written through") {
    const TemporaryFolder folder;
    const auto path = folder.path() / "a.csv", victim = folder.path() / "victim";
    defrec::test::write_file(victim, std::string("mine"));
    std::filesystem::create_symlink(victim, path);
    write_atomically(path, "x");
    CHECK(text_of(path) == "x");
    CHECK(text_of(victim) == "mine");
    std::filesystem::remove(path);
    REQUIRE(::mkfifo(path.c_str(), 0600) == 0);
    write_atomically(path, "y");
    CHECK(text_of(path) == "y");
}
