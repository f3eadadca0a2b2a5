// A full disk, links and FIFOs.
#include <doctest/doctest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <string>

#include "sdk/base/os/test_atomic_file.hpp"

using namespace defrec;
using namespace defrec::test;

namespace {

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

}  // namespace

TEST_CASE("row 75: a name as long as the file system lets it be") {
    const TemporaryFolder folder;
    std::string name;
    while (name.size() + 6 <= 255) name += "\u00e4";
    const auto path = folder.path() / (name + ".csv");
    write_atomically(path, "x");
    CHECK(text_of(path) == "x");
    CHECK(files_in(folder.path()) == 1);
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

TEST_CASE("row 85: a link, a FIFO or a folder in a temporary file's place is passed over") {
    const TemporaryFolder folder;
    const auto path = folder.path() / "a.csv", victim = folder.path() / "victim";
    defrec::test::write_file(victim, std::string("mine"));
    std::filesystem::create_symlink(victim, folder.path() / "a.defrec-0.partial.csv");
    REQUIRE(::mkfifo((folder.path() / "a.defrec-1.partial.csv").c_str(), 0600) == 0);
    std::filesystem::create_directory(folder.path() / "a.defrec-2.partial.csv");
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

TEST_CASE("row 126: what a killed process left goes with the next, what others write stays") {
    const TemporaryFolder folder;
    const auto path = folder.path() / "a.csv";
    const pid_t child = ::fork();
    if (child == 0) {
        // Their destructors never run.
        new AtomicFile(path);
        new AtomicFile(folder.path() / "b.mp4");
        ::_exit(0);
    }
    int status = 0;
    REQUIRE(::waitpid(child, &status, 0) == child);
    REQUIRE(WEXITSTATUS(status) == 0);
    const auto left_behind = folder.path() / "b.defrec-0.partial.mp4";
    REQUIRE(files_in(folder.path()) == 2);
    REQUIRE(std::filesystem::exists(left_behind));
    for (const char* name : {"mine.partial.csv", "mine.defrec-.partial.csv", ".defrec-0.partial",
                             "mine.defrec-0.csv", "mine.0.partial.csv"})
        defrec::test::write_file(folder.path() / name, std::string("mine"));
    std::filesystem::create_symlink("mine.partial.csv", folder.path() / "c.defrec-0.partial.csv");

    AtomicFile first(path);
    CHECK(first.temporary().filename() == "a.defrec-0.partial.csv");
    AtomicFile second(path);
    CHECK(second.temporary().filename() == "a.defrec-1.partial.csv");
    remove_abandoned_files(folder.path());
    CHECK_FALSE(std::filesystem::exists(left_behind));
    CHECK(files_in(folder.path()) == 2 + 6);
    first.commit();
    second.commit();
    CHECK(files_in(folder.path()) == 1 + 6);
}
