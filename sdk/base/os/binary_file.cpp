// See binary_file.hpp.
#include "sdk/base/os/binary_file.hpp"

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/base/os/platform.hpp"
#include "sdk/base/util/file_checksum.hpp"

namespace defrec {

void BinaryWriter::save(const char* path) const {
    const uint64_t sum = file_checksum(bytes_.data(), bytes_.size());
    const std::filesystem::path target = std::filesystem::u8path(path);
    std::error_code ignored;
    if (std::filesystem::exists(target, ignored) &&
        !std::filesystem::is_regular_file(target, ignored))
        fail(DEFREC_ERROR_IO, "the ", kind_.name, " cannot be written to ", path,
             ": what is there is no file, and would be replaced");
    try {
        platform::without_file_size_signal([&] {
            AtomicFile file(target);
            file.write(bytes_);
            file.write({reinterpret_cast<const char*>(&sum), sizeof sum});
            file.commit();
        });
    } catch (const FileError& error) {
        fail(DEFREC_ERROR_IO, "the ", kind_.name, " cannot be written: ", error.what());
    }
}

BinaryReader::BinaryReader(const BinaryFileKind& kind, const char* path)
    : kind_(kind), path_(path) {
    if (path_.empty()) fail(DEFREC_ERROR_IO, "the path of the ", kind.name, " is empty");
    std::error_code error;
    const std::filesystem::path file_path = std::filesystem::u8path(path_);
    if (!std::filesystem::is_regular_file(file_path, error))
        fail(DEFREC_ERROR_IO, path_, " is not a file");
    // The size is the opened file's: another may be saved in its place meanwhile.
    errno = 0;
    std::ifstream file(file_path, std::ios::binary | std::ios::ate);
    if (!file)
        fail(DEFREC_ERROR_IO, path_, " cannot be opened: ", std::generic_category().message(errno));
    const std::streamoff size{file.tellg()};
    if (size < 0) fail(DEFREC_ERROR_IO, path_, " cannot be read");
    if (static_cast<uint64_t>(size) > kind.max_bytes)
        fail(DEFREC_ERROR_IO, path_, " has ", size, " bytes, at most ", kind.max_bytes,
             " expected of a ", kind.name);
    file.seekg(0);
    std::array<char, 8> magic{};
    if (!file.read(magic.data(), magic.size()) || magic != kind.magic)
        broken("it does not begin as one");
    bytes_.resize(static_cast<size_t>(size));
    file.seekg(0);
    if (!file.read(bytes_.data(), size)) fail(DEFREC_ERROR_IO, path_, " cannot be read");
    value(magic);
    uint32_t layout = 0;
    value(layout);
    if (layout != kind.layout)
        fail(DEFREC_ERROR_VERSION, path_, " has layout ", layout, ", this library reads ",
             kind.layout);
}

void BinaryReader::expect_end() {
    const size_t end = at_;
    uint64_t sum = 0;
    value(sum);
    if (at_ != bytes_.size()) broken("something follows its end");
    if (sum != file_checksum(bytes_.data(), end)) broken("its checksum does not fit");
}

}  // namespace defrec
