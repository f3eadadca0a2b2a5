// See atomic_file.hpp.
#include "sdk/base/os/atomic_file.hpp"

#include <cerrno>
#include <system_error>

#include "sdk/base/os/stdio_file.hpp"

namespace defrec {
namespace {

std::string describe(const std::filesystem::path& path, const std::string& what, int error) {
    std::string text(reinterpret_cast<const char*>(path.u8string().c_str()));
    text.append(": the file ").append(what);
    if (error != 0) text.append(" (").append(std::generic_category().message(error)).append(")");
    const bool lacks_descriptors = error == EMFILE || error == ENFILE;
    if (lacks_descriptors) return text;
    return text.append(
        "; check the folder's permissions, the space on its disk and the limit on file sizes");
}

// In the name of a file that is being written: STEM.defrec-NUMBER.partial.EXTENSION.
constexpr char kBeforeNumber[] = ".defrec-", kAfterNumber[] = ".partial";

bool is_partial_name(const std::string& name) {
    const size_t before = name.rfind(kBeforeNumber);
    if (before == std::string::npos || before == 0) return false;
    const size_t first = before + sizeof kBeforeNumber - 1;
    const size_t end = name.find_first_not_of("0123456789", first);
    return end != std::string::npos && end > first &&
           name.compare(end, sizeof kAfterNumber - 1, kAfterNumber) == 0;
}

// Its first so many code units, or fewer, so that no character is cut in two.
std::filesystem::path shortened(const std::filesystem::path& name, size_t units) {
    std::u8string text = name.u8string();
    if (text.size() <= units) return name;
    while (units > 0 && (text[units] & 0xC0) == 0x80) --units;
    text.resize(units);
    return text;
}

}  // namespace

FileError::FileError(const std::filesystem::path& path, const std::string& what, int error)
    : std::runtime_error(describe(path, what, error)) {}

AtomicFile::AtomicFile(const std::filesystem::path& path)
    : path_(path), file_(nullptr, &std::fclose) {
    constexpr int kMaxNames = 1000;
    // A name has at most 255 bytes in most file systems.
    constexpr size_t kMaxStem = 200;
    const std::filesystem::path stem = shortened(path_.stem(), kMaxStem);
    for (int i = 0; i < kMaxNames && file_ == nullptr; ++i) {
        temporary_ = path_.parent_path() / stem;
        temporary_ += kBeforeNumber;
        temporary_ += std::to_string(i);
        temporary_ += kAfterNumber;
        temporary_ += path_.extension();
        errno = 0;
        file_.reset(create_file(temporary_));
        if (file_ == nullptr && errno != EEXIST) break;
        if (file_ == nullptr && remove_abandoned(temporary_)) --i;
    }
    if (file_ == nullptr) throw FileError(path_, "cannot be created", errno);
}

AtomicFile::~AtomicFile() {
    if (temporary_.empty()) return;
    file_.reset();
    std::error_code ignored;
    std::filesystem::remove(temporary_, ignored);
}

void AtomicFile::write(std::string_view bytes) {
    errno = 0;
    if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size())
        throw FileError(path_, "cannot be written", errno);
}

void AtomicFile::flush() {
    errno = 0;
    if (std::fflush(file_.get()) != 0) throw FileError(path_, "cannot be written", errno);
}

void AtomicFile::commit(Durability durability) {
    flush();
    // Its bytes first, then its name: also where the power fails in between.
    if (durability == Durability::kNow && !synchronise(file_.get()))
        throw FileError(path_, "cannot be written", errno);
    const std::error_code error = close_as(file_.release(), temporary_, path_);
    if (error) throw FileError(path_, "cannot be given its name", error.value());
    temporary_.clear();
}

void remove_abandoned_files(const std::filesystem::path& folder) {
    std::error_code error;
    for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end;
         entry.increment(error)) {
        const std::u8string name = entry->path().filename().u8string();
        if (is_partial_name({name.begin(), name.end()})) remove_abandoned(entry->path());
    }
}

void write_atomically(const std::filesystem::path& path, std::string_view bytes) {
    AtomicFile file(path);
    file.write(bytes);
    file.commit();
}

}  // namespace defrec
