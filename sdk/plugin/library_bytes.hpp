// What the readers of libraries share (shared_object_posix.cpp, pe_file.cpp): the bytes of a file,
// and refusals that name it.
#pragma once
#include <cstdint>
#include <cstring>
#include <span>
#include <string>

#include "sdk/base/util/error.hpp"

namespace defrec {

class LibraryBytes {
  public:
    LibraryBytes(const std::string& path, std::span<const unsigned char> bytes)
        : path_(path), bytes_(bytes) {}

  protected:
    template <class... Pieces>
    [[noreturn]] void refuse(const Pieces&... pieces) const {
        fail(DEFREC_ERROR_PLUGIN, path_, ": ", pieces...);
    }

    void expect_inside(uint64_t offset, uint64_t size, const char* what) const {
        if (offset > bytes_.size() || size > bytes_.size() - offset)
            refuse("truncated: ", what, " ends beyond the ", bytes_.size(), " bytes of the file");
    }

    // A record of a table, which lies inside.
    template <class Record>
    Record record(uint64_t table, size_t index = 0) const {
        Record result;
        std::memcpy(&result, bytes_.data() + table + index * sizeof result, sizeof result);
        return result;
    }

    std::span<const unsigned char> bytes() const { return bytes_; }

  private:
    const std::string& path_;
    std::span<const unsigned char> bytes_;
};

}  // namespace defrec
