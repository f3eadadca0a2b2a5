// See run_name.hpp.
#include "sdk/session/run_name.hpp"

#include <algorithm>

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

// Without a separator at its end.
fs::path whole(const fs::path& path) {
    fs::path result = fs::absolute(path).lexically_normal();
    return result.has_filename() ? result : result.parent_path();
}

// The folders that both paths begin with.
fs::path common_folder(const fs::path& a, const fs::path& b) {
    const auto ends = std::mismatch(a.begin(), a.end(), b.begin(), b.end());
    fs::path folder;
    for (auto part = a.begin(); part != ends.first; ++part) folder /= *part;
    return folder;
}

}  // namespace

std::string run_name(const SourceOptions& source, bool is_live, const fs::path& folder) {
    const bool has_both = !source.bag.is_given() && source.stereo.empty();
    if (!has_both || is_live) return source.name();
    const fs::path left = whole(source.left), right = whole(source.right);
    const fs::path common = left == right ? left.parent_path() : common_folder(left, right);
    const fs::path name = common.has_filename() ? common.filename() : whole(folder).filename();
    return name.string();
}

}  // namespace defrec::cli
