// Files that appear whole or not at all: written under a temporary name in the same folder, then
// renamed.
#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace defrec::cli {

// Creates the folder and its parents. Throws CliError(kOutput).
void create_output_folder(const std::filesystem::path& path);

// Every failure (not writable, disk full) is a CliError(kOutput) that names the file. One thread at
// a time.
class AtomicFile {
  public:
    explicit AtomicFile(const std::filesystem::path& path);
    // Removes the temporary file when commit() was not reached.
    ~AtomicFile();
    AtomicFile(const AtomicFile&) = delete;
    AtomicFile& operator=(const AtomicFile&) = delete;

    void write(std::string_view bytes);
    // Closes the file and gives it its name, replacing one that stood there. May be called once.
    void commit();

  private:
    [[noreturn]] void fail(const std::string& what) const;

    std::filesystem::path path_, temporary_;
    std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
};

void write_atomically(const std::filesystem::path& path, std::string_view bytes);

}  // namespace defrec::cli
