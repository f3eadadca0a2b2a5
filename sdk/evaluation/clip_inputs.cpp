// See clip_inputs.hpp.
#include "sdk/evaluation/clip_inputs.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <set>

#include "sdk/base/util/fnv1a.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

bool is_text(const fs::path& file) {
    constexpr const char* kEnds[] = {".csv", ".ini", ".json", ".txt", ".yaml", ".yml"};
    const std::string end = file.extension().string();
    return std::find(std::begin(kEnds), std::end(kEnds), end) != std::end(kEnds);
}

class InputDigest {
  public:
    explicit InputDigest(const fs::path& out) {
        std::error_code error;
        seen_.insert(fs::canonical(out, error));
    }

    // name: below the input. What cannot be read counts by its name; running the clip says why.
    void add(const fs::path& path, const std::string& name) {
        std::error_code error;
        if (fs::is_directory(path, error))
            add_folder(path, name);
        else
            add_file(path, name);
    }

    std::string hex() const {
        std::array<char, 17> digits{};
        std::snprintf(digits.data(), digits.size(), "%016llx",
                      static_cast<unsigned long long>(hash_));
        return digits.data();
    }

  private:
    void add_folder(const fs::path& folder, const std::string& name) {
        std::error_code error;
        // Links may lead to one folder twice, or back.
        if (!seen_.insert(fs::canonical(folder, error)).second) return;
        std::vector<fs::path> entries;
        for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
             entry.increment(error))
            if (!entry->path().filename().string().starts_with('.'))
                entries.push_back(entry->path());
        std::sort(entries.begin(), entries.end());
        for (const fs::path& entry : entries) add(entry, name + "/" + entry.filename().string());
    }

    void add_file(const fs::path& file, const std::string& name) {
        std::error_code error;
        const std::uint64_t size = fs::file_size(file, error);
        hash_ = fnv1a(fnv1a(hash_, name.c_str(), name.size() + 1), &size, sizeof size);
        if (!is_text(file)) return;
        std::ifstream stream(file, std::ios::binary);
        std::array<char, 1 << 16> block{};
        while (stream.read(block.data(), block.size()) || stream.gcount() > 0)
            hash_ = fnv1a(hash_, block.data(), static_cast<std::size_t>(stream.gcount()));
    }

    std::set<fs::path> seen_;  // canonical folders
    std::uint64_t hash_ = kFnvBasis;
};

}  // namespace

std::string digest_of_inputs(const std::vector<fs::path>& inputs, const fs::path& out) {
    InputDigest digest(out);
    for (std::size_t i = 0; i < inputs.size(); ++i) digest.add(inputs[i], std::to_string(i));
    return digest.hex();
}

}  // namespace defrec::cli
