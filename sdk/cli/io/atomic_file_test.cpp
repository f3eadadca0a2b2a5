// Row 72: a full disk and a folder that cannot be written end with exit code 7, and no half file is
// left.
#include "sdk/cli/io/atomic_file.hpp"

#include <doctest/doctest.h>
#include <signal.h>
#include <sys/resource.h>

#include <string>

#include "sdk/cli/io/exit_code.hpp"
#include "sdk/cli/io/test_folder.hpp"

using namespace defrec::cli;

namespace {

template <typename Function>
std::string output_failure(const Function& function) {
    try {
        function();
    } catch (const CliError& error) {
        CHECK(error.code() == ExitCode::kOutput);
        return error.what();
    }
    return "no failure";
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
    const TestFolder folder;
    const std::string path = folder.write("a.csv", "old");
    {
        AtomicFile file(path);
        file.write("new");
        CHECK(TestFolder::read(path) == "old");
        file.commit();
    }
    CHECK(TestFolder::read(path) == "new");
    { AtomicFile(path).write("dropped"); }
    CHECK(TestFolder::read(path) == "new");
    CHECK(files_in(folder.path()) == 1);
}

TEST_CASE("row 72: a full disk") {
    const TestFolder folder;
    const std::string path = folder / "a.csv";
    std::string message;
    {
        const FileSizeLimit limit(1000);
        message = output_failure([&] { write_atomically(path, std::string(100'000, 'x')); });
    }
    CHECK_MESSAGE(message.find("a.csv") != std::string::npos, message);
    CHECK_MESSAGE(message.find("space") != std::string::npos, message);
    CHECK(files_in(folder.path()) == 0);
}

TEST_CASE("row 72: a folder that cannot be written or created") {
    const TestFolder folder;
    const std::string file = folder.write("file", "");
    CHECK(output_failure([&] {
              write_atomically(file + "/a.csv", "x");
          }).find("cannot be created") != std::string::npos);
    CHECK(output_failure([&] { create_output_folder(file); }).find("--out") != std::string::npos);
    CHECK(output_failure([&] { create_output_folder(file + "/inner"); }).find("--out") !=
          std::string::npos);
    std::filesystem::create_directory(folder / "taken.csv");
    CHECK(output_failure([&] { write_atomically(folder / "taken.csv", "x"); }).find("name") !=
          std::string::npos);
}

TEST_CASE("row 75: paths are UTF-8") {
    const TestFolder folder;
    const std::string inner = folder / "Läsion 肝臓";
    create_output_folder(inner);
    write_atomically(inner + "/größe.csv", "x");
    CHECK(TestFolder::read(inner + "/größe.csv") == "x");
}
