// Files that appear whole or not at all: written under another name in the same folder, then
// renamed.
#pragma once
#include <cstdio>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>

namespace defrec {

// A file that cannot be written: its path, what failed, and the system's reason.
class FileError : public std::runtime_error {
  public:
    FileError(const std::filesystem::path& path, const std::string& what, int error);
};

// Every failure (not writable, disk full) is a FileError. One thread at a time.
class AtomicFile {
  public:
    // Under a name of its own: several may be written to one path at the same time. What a process
    // that died left under such a name is removed.
    explicit AtomicFile(const std::filesystem::path& path);
    // Removes the file unless commit() was reached.
    ~AtomicFile();
    AtomicFile(const AtomicFile&) = delete;
    AtomicFile& operator=(const AtomicFile&) = delete;

    const std::filesystem::path& path() const { return path_; }
    // The file until then, with the extension of the path, for a library that writes it by its
    // name.
    const std::filesystem::path& temporary() const { return temporary_; }

    void write(std::string_view bytes);
    // Hands what was written to the system: it outlives the process, under the temporary name.
    void flush();
    // Whether the disk has a file before it gets its name, or whenever the system writes it: the
    // power may fail in between.
    enum class Durability { kNow, kLater };
    // Closes the file and gives it its name, replacing one that stood there. May be called once.
    void commit(Durability durability = Durability::kNow);

  private:
    std::filesystem::path path_, temporary_;  // temporary_: empty once renamed
    std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
};

// Removes what processes that died have left of AtomicFiles in the folder, and nothing of others.
void remove_abandoned_files(const std::filesystem::path& folder);

void write_atomically(const std::filesystem::path& path, std::string_view bytes);

}  // namespace defrec
