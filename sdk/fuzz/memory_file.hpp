// Bytes as a file with a path, for readers that open paths.
#pragma once
#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>
#include <span>
#include <string>

namespace defrec::fuzz {

class MemoryFile {
  public:
    explicit MemoryFile(std::span<const unsigned char> bytes)
        : descriptor_(memfd_create("fuzz", MFD_CLOEXEC)) {
        const auto size = static_cast<ssize_t>(bytes.size());
        if (descriptor_ < 0 || write(descriptor_, bytes.data(), bytes.size()) != size) std::abort();
    }
    ~MemoryFile() { close(descriptor_); }
    MemoryFile(const MemoryFile&) = delete;
    MemoryFile& operator=(const MemoryFile&) = delete;

    std::string path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }

  private:
    int descriptor_;
};

}  // namespace defrec::fuzz
