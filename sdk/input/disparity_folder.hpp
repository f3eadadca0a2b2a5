// Disparity of a recording's frames that was measured elsewhere, in a folder of files: PFM, px, or
// PNG of 16 bits, 1/256 px. A file belongs to the frame whose number its name has.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace defrec::cli {

// px, row by row, 0: none there.
using DisparityImage = std::vector<float>;

// The digits of a file's name without its extension.
std::string digits_of(const std::filesystem::path& file);
// The numbers of a folder's files: of those in a name, the last one that is not the same in all
// files; where all are, or some names have more of them, the last one. Empty where there is none,
// or a digit too many.
std::vector<std::optional<std::int64_t>> numbers_of(
    const std::vector<std::filesystem::path>& files);

class DisparityFolder {
  public:
    // Throws CliError(kInput) where there is no file, one without a number, or two of one number.
    explicit DisparityFolder(const std::filesystem::path& folder);

    // Disparity of the frame of that number; null: it has no file. Throws CliError(kInput) naming
    // the file for another size, another format, what is cut short, and a negative disparity.
    std::shared_ptr<const DisparityImage> read(std::int64_t number, int width, int height) const;
    bool has(std::int64_t number) const { return files_.contains(number); }
    std::size_t count() const { return files_.size(); }
    // The smallest and the largest number of a file.
    std::int64_t first() const { return files_.begin()->first; }
    std::int64_t last() const { return files_.rbegin()->first; }

  private:
    std::map<std::int64_t, std::filesystem::path> files_;
};

}  // namespace defrec::cli
