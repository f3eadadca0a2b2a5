// A bag in an SQLite file, its topics, and its messages as images and calibrations.
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <memory>
#include <string>

#include "sdk/bag/sqlite_reader.hpp"
#include "sdk/bag/stereo_topics.hpp"
#include "sdk/fuzz/bag_message.hpp"
#include "sdk/io/exit_code.hpp"

namespace {

using namespace defrec::cli;

// With a name: SQLite resolves links, and finds no MemoryFile behind its one. In memory where the
// system has a folder for that.
class NamedFile {
  public:
    NamedFile(const uint8_t* data, size_t size) {
        const int descriptor = ::mkstemp(path_.data());
        if (descriptor < 0 || ::write(descriptor, data, size) != static_cast<ssize_t>(size))
            std::abort();
        ::close(descriptor);
    }
    ~NamedFile() { ::unlink(path_.c_str()); }
    NamedFile(const NamedFile&) = delete;
    NamedFile& operator=(const NamedFile&) = delete;

    const std::string& path() const { return path_; }

  private:
    static std::string folder() { return ::access("/dev/shm", W_OK) == 0 ? "/dev/shm" : "/tmp"; }

    std::string path_ = folder() + "/defrec_sqlite_bag_fuzz_XXXXXX";
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const NamedFile file(data, size);
    try {
        const std::unique_ptr<BagReader> reader = open_sqlite_bag(file.path());
        BagMessage message;
        size_t taken = 0;
        while (reader->next(message)) {
            defrec::fuzz::take(message);
            taken += message.data.size();
        }
        defrec::fuzz::require(taken <= size);
        static_cast<void>(choose_topics("fuzz", topics_of_sqlite_bag(file.path()), "", ""));
    } catch (const CliError&) {
    }
    return 0;
}
