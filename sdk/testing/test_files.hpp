// Files and folders for the tests of the loader.
#pragma once
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "sdk/base/util/sha256.hpp"

namespace defrec::test {

// Absolute, gone with the object.
class TemporaryFolder {
  public:
    TemporaryFolder() {
        std::random_device random;
        do
            path_ = std::filesystem::temp_directory_path() /
                    ("defrec-test-" + std::to_string(random()));
        while (!std::filesystem::create_directory(path_));
        std::filesystem::permissions(path_, std::filesystem::perms::owner_all);
    }
    ~TemporaryFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    const std::filesystem::path& path() const { return path_; }

  private:
    std::filesystem::path path_;
};

inline std::vector<unsigned char> read_file(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

inline void write_file(const std::filesystem::path& path, const std::vector<unsigned char>& bytes) {
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
}
inline void write_file(const std::filesystem::path& path, const std::string& text) {
    write_file(path, std::vector<unsigned char>(text.begin(), text.end()));
}

// The manifest of a plugin "good" in library bytes; hash "" means the right one.
inline std::string manifest_text(const std::string& library,
                                 const std::vector<unsigned char>& bytes, std::string hash = "") {
    if (hash.empty()) hash = sha256_hex(bytes);
    return R"({"name": "good", "version": "1", "library": ")" + library +
           R"(", "abi_major": 1, "abi_minor": 0, "sha256": ")" + hash + "\"}";
}

// Where CMake put the plugin <name> of sdk/plugin/test_plugins.
inline std::filesystem::path stub_folder(const std::string& name) {
    return std::filesystem::path(DEFREC_BUILD_DIR) / "test_plugins" / name;
}

}  // namespace defrec::test
