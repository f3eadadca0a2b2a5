// See view_matches.hpp.
#include "sdk/doctor/view_matches.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "sdk/doctor/decisions.hpp"

namespace defrec::cli {
namespace {

using Decision = decisions::DoctorMatches;

constexpr int kHalf = Decision::kHalfPatch;

cv::Rect image_rect(const cv::Mat& image) { return {0, 0, image.cols, image.rows}; }

cv::Rect patch_at(cv::Point centre) {
    return {centre.x - kHalf, centre.y - kHalf, 2 * kHalf + 1, 2 * kHalf + 1};
}

bool holds(const cv::Mat& image, const cv::Rect& rect) {
    return (rect & image_rect(image)) == rect;
}

// The maximum of a parabola through three values lies so far from the middle one.
double peak(double before, double at, double after) {
    const double curvature = before - 2 * at + after;
    return curvature < 0 ? std::clamp(0.5 * (before - after) / curvature, -0.5, 0.5) : 0;
}

struct Place {
    cv::Point2d at;
    double score = 0, lead = 0;  // lead: over the best score elsewhere
};

// The place in `to` of the patch of `from` round `centre`, among the centres in `window`.
std::optional<Place> search(const cv::Mat& from, cv::Point centre, const cv::Mat& to,
                            const cv::Rect& window) {
    const cv::Rect patch = patch_at(centre);
    const cv::Rect area = cv::Rect(window.x - kHalf, window.y - kHalf, window.width + 2 * kHalf,
                                   window.height + 2 * kHalf) &
                          image_rect(to);
    if (!holds(from, patch) || area.width < patch.width || area.height < patch.height)
        return std::nullopt;
    cv::Mat scores;
    cv::matchTemplate(to(area), from(patch), scores, cv::TM_CCOEFF_NORMED);
    Place place;
    cv::Point best;
    cv::minMaxLoc(scores, nullptr, &place.score, nullptr, &best);
    const auto score = [&](int x, int y) { return double{scores.at<float>(y, x)}; };
    cv::Point2d within(0, 0);
    if (best.x > 0 && best.x + 1 < scores.cols)
        within.x = peak(score(best.x - 1, best.y), place.score, score(best.x + 1, best.y));
    if (best.y > 0 && best.y + 1 < scores.rows)
        within.y = peak(score(best.x, best.y - 1), place.score, score(best.x, best.y + 1));
    place.at = cv::Point2d(area.x + kHalf + best.x, area.y + kHalf + best.y) + within;
    scores(cv::Rect(best.x - kHalf / 2, best.y - kHalf / 2, kHalf, kHalf) & image_rect(scores))
        .setTo(-1);
    double second = -1;
    cv::minMaxLoc(scores, nullptr, &second);
    place.lead = place.score - second;
    return place;
}

cv::Point rounded(cv::Point2d p) {
    return {static_cast<int>(std::lround(p.x)), static_cast<int>(std::lround(p.y))};
}

cv::Rect window_round(cv::Point2d at, int reach_x, int reach_y) {
    const cv::Point centre = rounded(at);
    return {centre.x - reach_x, centre.y - reach_y, 2 * reach_x + 1, 2 * reach_y + 1};
}

// Both views at one size. A pixel of the frames times the scale is one of these.
struct Level {
    cv::Mat left, right;
    double scale_x = 1, scale_y = 1;

    cv::Point2d down(cv::Point2d p) const {
        return {(p.x + 0.5) * scale_x - 0.5, (p.y + 0.5) * scale_y - 0.5};
    }
    cv::Point2d up(cv::Point2d p) const {
        return {(p.x + 0.5) / scale_x - 0.5, (p.y + 0.5) / scale_y - 0.5};
    }
};

Level level_of(const cv::Mat& left, const cv::Mat& right, int width) {
    if (width >= left.cols) return {left, right, 1, 1};
    Level level;
    const cv::Size size(
        width, std::max(1, static_cast<int>(std::lround(double(left.rows) * width / left.cols))));
    cv::resize(left, level.left, size, 0, 0, cv::INTER_AREA);
    cv::resize(right, level.right, size, 0, 0, cv::INTER_AREA);
    level.scale_x = double(size.width) / left.cols;
    level.scale_y = double(size.height) / left.rows;
    return level;
}

// Centres of patches that show neither a highlight nor text, nor the border of the picture.
cv::Mat tissue_of(const cv::Mat& image) {
    cv::Mat tissue, centres;
    cv::inRange(image, Decision::kBorder, Decision::kHighlight, tissue);
    cv::erode(tissue, centres,
              cv::getStructuringElement(cv::MORPH_RECT, {2 * kHalf + 1, 2 * kHalf + 1}), {-1, -1},
              1, cv::BORDER_CONSTANT, cv::Scalar(0));
    return centres;
}

// The right view's place of a corner of the coarse image, which leads back to the corner.
std::optional<cv::Point2d> coarse_place(const Level& coarse, cv::Point corner) {
    const int rows = static_cast<int>(std::ceil(Decision::kMaxRowShare * coarse.left.rows));
    const auto there =
        search(coarse.left, corner, coarse.right, window_round(corner, coarse.left.cols, rows));
    if (!there || there->score < Decision::kMinScore || there->lead < Decision::kMinLead)
        return std::nullopt;
    const auto back = search(coarse.right, rounded(there->at), coarse.left,
                             window_round(there->at, coarse.left.cols, rows));
    if (!back || cv::norm(back->at - cv::Point2d(corner)) > Decision::kMaxReturn)
        return std::nullopt;
    return there->at;
}

}  // namespace

std::vector<ViewMatch> match_views(const cv::Mat& left, const cv::Mat& right) {
    const Level coarse = level_of(left, right, Decision::kCoarseWidth);
    std::vector<Level> finer;
    if (left.cols > Decision::kCoarseWidth)
        finer.push_back(level_of(left, right, Decision::kMiddleWidth));
    if (left.cols > Decision::kMiddleWidth) finer.push_back({left, right, 1, 1});

    std::vector<cv::Point2f> corners;
    cv::goodFeaturesToTrack(coarse.left, corners, Decision::kMaxCorners, Decision::kCornerQuality,
                            Decision::kCornerDistance * coarse.left.cols, tissue_of(coarse.left));
    std::vector<ViewMatch> matches;
    for (const cv::Point2f& found : corners) {
        const cv::Point corner = rounded(found);
        const auto place = coarse_place(coarse, corner);
        if (!place) continue;
        ViewMatch match{coarse.up(corner), coarse.up(*place)};
        bool is_found = true;
        for (const Level& level : finer) {
            const cv::Point centre = rounded(level.down(match.left));
            const auto refined =
                search(level.left, centre, level.right,
                       window_round(level.down(match.right + level.up(centre) - match.left),
                                    Decision::kRefine, Decision::kRefine));
            is_found = refined && refined->score >= Decision::kMinScore;
            if (!is_found) break;
            match = {level.up(centre), level.up(refined->at)};
        }
        if (is_found) matches.push_back(match);
    }
    return matches;
}

}  // namespace defrec::cli
