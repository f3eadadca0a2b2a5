// See copied_blocks.hpp.
#include "sdk/input/compression/copied_blocks.hpp"

#include <cstdlib>

#include "sdk/input/compression/decisions.hpp"

namespace defrec::cli {
namespace {

using decisions::CopiedBlock;

constexpr int kSide = CopiedBlock::kSide;

enum class Found { kNoTexture, kNew, kStill, kMoved };

// Enough contrast along rows and along columns that a block fits in one place only.
bool has_texture(const cv::Mat& gray, int x0, int y0) {
    int along_rows = 0, along_columns = 0, sum = 0;
    for (int y = y0; y < y0 + kSide - 1; ++y) {
        const auto *row = gray.ptr<std::uint8_t>(y), *next = gray.ptr<std::uint8_t>(y + 1);
        for (int x = x0; x < x0 + kSide - 1; ++x) {
            along_rows += std::abs(row[x + 1] - row[x]);
            along_columns += std::abs(next[x] - row[x]);
            sum += row[x];
        }
    }
    constexpr int kPixels = (kSide - 1) * (kSide - 1);
    return along_rows >= CopiedBlock::kMinStep * kPixels &&
           along_columns >= CopiedBlock::kMinStep * kPixels &&
           sum >= CopiedBlock::kMinGray * kPixels;
}

bool is_copy(const cv::Mat& gray, const cv::Mat& before, cv::Point at, cv::Point from) {
    constexpr int kMost = static_cast<int>(CopiedBlock::kMaxDifference * kSide * kSide);
    int sum = 0;
    for (int y = 0; y < kSide; ++y) {
        const std::uint8_t *row = gray.ptr<std::uint8_t>(at.y + y) + at.x,
                           *other = before.ptr<std::uint8_t>(from.y + y) + from.x;
        for (int x = 0; x < kSide; ++x) sum += std::abs(row[x] - other[x]);
        if (sum > kMost) return false;
    }
    return true;
}

Found look_for(const cv::Mat& gray, const cv::Mat& before, cv::Point at) {
    if (!has_texture(gray, at.x, at.y)) return Found::kNoTexture;
    if (is_copy(gray, before, at, at)) return Found::kStill;
    const cv::Rect places(0, 0, gray.cols - kSide + 1, gray.rows - kSide + 1);
    for (int dy = -CopiedBlock::kReach; dy <= CopiedBlock::kReach; ++dy)
        for (int dx = -CopiedBlock::kReach; dx <= CopiedBlock::kReach; ++dx)
            if (const cv::Point from = at + cv::Point(dx, dy);
                places.contains(from) && is_copy(gray, before, at, from))
                return Found::kMoved;
    return Found::kNew;
}

}  // namespace

void CopiedBlocks::add(const cv::Mat& gray) {
    const int columns = gray.cols / kSide, rows = gray.rows / kSide;
    const cv::Mat before = before_;
    before_ = gray.clone();
    if (before.empty()) {
        blocks_.resize(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
        return;
    }
    std::vector<Found> found;
    int textured = 0, still = 0;
    for (int y = 0; y < rows; ++y)
        for (int x = 0; x < columns; ++x) {
            found.push_back(look_for(gray, before, {x * kSide, y * kSide}));
            textured += found.back() != Found::kNoTexture ? 1 : 0;
            still += found.back() == Found::kStill ? 1 : 0;
        }
    // A recorder repeats whole frames as well.
    if (still > CopiedBlock::kRepeated * textured) return;
    for (std::size_t i = 0; i < found.size(); ++i) {
        if (found[i] == Found::kNoTexture) continue;
        ++blocks_[i].textured;
        if (found[i] == Found::kNew) continue;
        ++blocks_[i].copied;
        if (found[i] == Found::kStill) ++blocks_[i].still;
    }
}

std::optional<double> CopiedBlocks::share() const {
    int textured = 0, copied = 0;
    for (const Counts& block : blocks_) {
        if (block.still == block.textured) continue;
        textured += block.textured;
        copied += block.copied;
    }
    if (textured < CopiedBlock::kMinBlocks) return {};
    return static_cast<double>(copied) / textured;
}

}  // namespace defrec::cli
