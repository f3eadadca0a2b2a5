// A file that gets its name only when it is complete.
#pragma once

#include <filesystem>

namespace defrec::cli {

class OutputFile {
  public:
    /// Creates the temporary file beside `path` (same extension). Throws std::runtime_error if that
    /// cannot be done.
    explicit OutputFile(std::filesystem::path path);
    /// Removes the temporary file unless commit() succeeded.
    ~OutputFile();
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;

    const std::filesystem::path& path() const { return path_; }
    const std::filesystem::path& temporary() const { return temporary_; }

    /// Renames; throws std::runtime_error.
    void commit();

  private:
    std::filesystem::path path_, temporary_;
};

}  // namespace defrec::cli
