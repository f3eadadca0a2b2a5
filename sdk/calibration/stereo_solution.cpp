// See stereo_solution.hpp. OpenCV fits the cameras: Z. Zhang, "A flexible new technique for camera
// calibration", 2000.
#include "sdk/calibration/stereo_solution.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <opencv2/calib3d.hpp>

#include "sdk/calibration/decisions.hpp"
#include "sdk/io/exit_code.hpp"

namespace defrec::cli {
namespace {

using decisions::BoardFit;
using decisions::BoardVerdict;

using Points = std::vector<cv::Point2f>;

// What OpenCV is given, a board a frame.
struct Boards {
    std::vector<std::vector<cv::Point3f>> places;
    std::vector<Points> left, right;
};

Boards boards_of(const BoardFinder& finder, const BoardRecording& recording,
                 const std::vector<std::size_t>& frames) {
    Boards made;
    for (const std::size_t i : frames) {
        const BoardFrame& frame = recording.frames[i];
        made.places.emplace_back();
        for (const int id : frame.left.ids) made.places.back().push_back(finder.place(id));
        made.left.push_back(frame.left.corners);
        made.right.push_back(frame.right.corners);
    }
    return made;
}

int flags_of(int coefficients) {
    switch (coefficients) {
        case 0:
            return cv::CALIB_FIX_K1 | cv::CALIB_FIX_K2 | cv::CALIB_FIX_K3 |
                   cv::CALIB_ZERO_TANGENT_DIST;
        case 4:
            return cv::CALIB_FIX_K3;
        case 8:
            return cv::CALIB_RATIONAL_MODEL;
        default:
            return 0;
    }
}

double root_mean_square(const std::vector<double>& values) {
    double sum = 0;
    for (const double value : values) sum += value * value;
    return values.empty() ? 0 : std::sqrt(sum / static_cast<double>(values.size()));
}

double median_of(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

// The largest of a view's boards against the image plane, degrees.
double max_tilt(const std::vector<cv::Mat>& turns) {
    double most = 0;
    for (const cv::Mat& turn : turns) {
        cv::Matx33d rotation;
        cv::Rodrigues(turn, rotation);
        const double facing = std::min(1.0, std::abs(rotation(2, 2)));
        most = std::max(most, 180 / std::numbers::pi * std::acos(facing));
    }
    return most;
}

// A view by itself.
void fit_view(const Boards& boards, const std::vector<Points>& corners, const cv::Size& size,
              int flags, ViewSolution& view, StereoSolution& solution) {
    std::vector<cv::Mat> turns, shifts;
    cv::Mat deviations, of_boards, of_frames;
    view.matrix = cv::Mat();
    view.distortion = cv::Mat();
    cv::calibrateCamera(boards.places, corners, size, view.matrix, view.distortion, turns, shifts,
                        deviations, of_boards, of_frames, flags);
    view.focal_error = deviations.at<double>(0) / view.matrix.at<double>(0, 0);
    solution.max_tilt_degrees = std::max(solution.max_tilt_degrees, max_tilt(turns));
    std::vector<double> away;
    for (const cv::Mat& shift : shifts) away.push_back(cv::norm(shift));
    solution.distance_mm = median_of(away);
}

void fit(const Boards& boards, const cv::Size& size, int flags, StereoSolution& solution) {
    solution.max_tilt_degrees = 0;
    fit_view(boards, boards.right, size, flags, solution.right, solution);
    fit_view(boards, boards.left, size, flags, solution.left, solution);
    cv::Mat essential, fundamental, of_frames;
    const cv::TermCriteria until(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 100, 1e-9);
    solution.rotation = cv::Mat();
    solution.translation = cv::Mat();
    cv::stereoCalibrate(boards.places, boards.left, boards.right, solution.left.matrix,
                        solution.left.distortion, solution.right.matrix, solution.right.distortion,
                        size, solution.rotation, solution.translation, essential, fundamental,
                        of_frames, flags | cv::CALIB_USE_INTRINSIC_GUESS, until);
    std::array<std::vector<double>, 2> of_views;
    solution.frame_px.clear();
    for (int i = 0; i < of_frames.rows; ++i) {
        const double left = of_frames.at<double>(i, 0), right = of_frames.at<double>(i, 1);
        of_views[0].push_back(left);
        of_views[1].push_back(right);
        solution.frame_px.push_back(std::sqrt((left * left + right * right) / 2));
    }
    solution.left.residual_px = root_mean_square(of_views[0]);
    solution.right.residual_px = root_mean_square(of_views[1]);
}

// Takes frames that do not fit out of `used`; true where there were any.
bool leave_out(StereoSolution& solution) {
    const double limit = std::max(BoardFit::kMinFrameResidual,
                                  BoardFit::kMaxFrameResidual * median_of(solution.frame_px));
    std::vector<std::size_t> kept;
    for (std::size_t i = 0; i < solution.used.size(); ++i)
        if (solution.frame_px[i] <= limit) kept.push_back(solution.used[i]);
    const std::size_t out = solution.used.size() - kept.size();
    solution.left_out += out;
    solution.used = std::move(kept);
    return out > 0;
}

void require_pairs(const StereoSolution& solution, const BoardRecording& recording) {
    if (static_cast<int>(solution.used.size()) >= BoardVerdict::kMinPairs) return;
    throw CliError(ExitCode::kCalibration,
                   "only " + std::to_string(solution.used.size()) +
                       " pairs of images show the board in poses of its own, sharp and without "
                       "motion, of " +
                       std::to_string(recording.frames.size()) + " with the board; " +
                       std::to_string(solution.left_out) +
                       " did not fit. Expected: " + std::to_string(BoardVerdict::kMinPairs) +
                       " and more, better 20 to 40, with the board near and far, tilted to each "
                       "side, and in the corners of both views.");
}

// The image's nine regions.
std::string region_of(const cv::Point2f& pixel, const cv::Size& size) {
    static constexpr std::array<const char*, 3> kRows = {"top", "middle", "bottom"};
    static constexpr std::array<const char*, 3> kColumns = {"left", "centre", "right"};
    const auto third = [](float at, int all) {
        return static_cast<std::size_t>(std::clamp(3 * static_cast<int>(at) / all, 0, 2));
    };
    return std::string(kRows[third(pixel.y, size.height)]) + " " +
           kColumns[third(pixel.x, size.width)];
}

void judge_coverage(const std::vector<Points>& views, const cv::Size& size, ViewSolution& view) {
    std::vector<bool> is_covered(
        static_cast<std::size_t>(BoardVerdict::kCellsAcross * BoardVerdict::kCellsDown), false);
    std::map<std::string, int> regions;
    for (int y = 0; y < 3; ++y)
        for (int x = 0; x < 3; ++x)
            regions[region_of(cv::Point2f(static_cast<float>((x + 0.5) * size.width / 3),
                                          static_cast<float>((y + 0.5) * size.height / 3)),
                              size)] = 0;
    for (const Points& corners : views)
        for (const cv::Point2f& corner : corners) {
            const int x = std::clamp(
                          static_cast<int>(corner.x) * BoardVerdict::kCellsAcross / size.width, 0,
                          BoardVerdict::kCellsAcross - 1),
                      y = std::clamp(
                          static_cast<int>(corner.y) * BoardVerdict::kCellsDown / size.height, 0,
                          BoardVerdict::kCellsDown - 1);
            is_covered[static_cast<std::size_t>(y * BoardVerdict::kCellsAcross + x)] = true;
            ++regions[region_of(corner, size)];
        }
    view.coverage = static_cast<double>(std::count(is_covered.begin(), is_covered.end(), true)) /
                    static_cast<double>(is_covered.size());
    view.missed.clear();
    for (const auto& [name, count] : regions)
        if (count == 0) view.missed.push_back(name);
}

struct Rectified {
    cv::Mat r1, r2, p1, p2;
};

Rectified rectify(const StereoSolution& solution, const cv::Size& size) {
    Rectified made;
    cv::Mat q;
    cv::stereoRectify(solution.left.matrix, solution.left.distortion, solution.right.matrix,
                      solution.right.distortion, size, solution.rotation, solution.translation,
                      made.r1, made.r2, made.p1, made.p2, q, cv::CALIB_ZERO_DISPARITY, -1);
    return made;
}

// The board in space against what it is: differences after the best rigid motion, mm, and how
// large it is, 1 for true.
struct Shape {
    std::vector<double> errors_mm;
    double factor = 1;
};
Shape shape_of(const std::vector<cv::Point3f>& board, const Points& left, const Points& right,
               const Rectified& rectified) {
    cv::Mat found;
    cv::triangulatePoints(rectified.p1, rectified.p2, left, right, found);
    cv::Mat truth(static_cast<int>(board.size()), 3, CV_64F), seen(truth.size(), CV_64F);
    for (int i = 0; i < truth.rows; ++i) {
        const cv::Point3f& place = board[static_cast<std::size_t>(i)];
        const cv::Vec3d values(place.x, place.y, place.z);
        for (int axis = 0; axis < 3; ++axis) {
            truth.at<double>(i, axis) = values[axis];
            seen.at<double>(i, axis) = found.at<float>(axis, i) / found.at<float>(3, i);
        }
    }
    for (cv::Mat* points : {&truth, &seen}) {
        cv::Mat middle;
        cv::reduce(*points, middle, 0, cv::REDUCE_AVG);
        *points -= cv::repeat(middle, points->rows, 1);
    }
    cv::Mat values, u, vt;
    cv::SVD::compute(truth.t() * seen, values, u, vt);
    cv::Mat sign = cv::Mat::eye(3, 3, CV_64F);
    sign.at<double>(2, 2) = cv::determinant(u * vt);
    const cv::Mat differences = seen - truth * (u * sign * vt);
    Shape shape;
    for (int i = 0; i < differences.rows; ++i)
        shape.errors_mm.push_back(cv::norm(differences.row(i)));
    shape.factor = cv::norm(seen) / cv::norm(truth);
    return shape;
}

struct RowSum {
    double sum = 0;
    int count = 0;
};

void judge_rows(const std::vector<double>& rows, const std::map<std::string, RowSum>& regions,
                StereoSolution& solution) {
    solution.rows_px = root_mean_square(rows);
    for (const auto& [name, region] : regions) {
        if (region.count < BoardVerdict::kMinRegionCorners) continue;
        const double mean = std::abs(region.sum / region.count);
        if (!solution.rows_region.empty() && mean <= solution.rows_bias_px) continue;
        solution.rows_bias_px = mean;
        solution.rows_region = name;
    }
}

// frames: with the board, but those that were left out.
void judge_stereo(const Boards& frames, const cv::Size& size, StereoSolution& solution) {
    const Rectified rectified = rectify(solution, size);
    std::vector<double> rows, shapes, factors;
    std::map<std::string, RowSum> regions;
    for (std::size_t frame = 0; frame < frames.left.size(); ++frame) {
        Points left, right;
        cv::undistortPoints(frames.left[frame], left, solution.left.matrix,
                            solution.left.distortion, rectified.r1, rectified.p1);
        cv::undistortPoints(frames.right[frame], right, solution.right.matrix,
                            solution.right.distortion, rectified.r2, rectified.p2);
        for (std::size_t i = 0; i < left.size(); ++i) {
            rows.push_back(left[i].y - right[i].y);
            RowSum& region = regions[region_of(frames.left[frame][i], size)];
            region.sum += rows.back();
            ++region.count;
        }
        const Shape shape = shape_of(frames.places[frame], left, right, rectified);
        shapes.insert(shapes.end(), shape.errors_mm.begin(), shape.errors_mm.end());
        factors.push_back(shape.factor);
    }
    judge_rows(rows, regions, solution);
    solution.shape_error_mm = root_mean_square(shapes);
    solution.length_error = median_of(factors) - 1;
    const double of_depth = solution.distance_mm * solution.distance_mm /
                            (rectified.p1.at<double>(0, 0) * solution.baseline_mm());
    solution.depth_error_mm = of_depth * solution.rows_px;
    solution.depth_bias_mm = of_depth * solution.rows_bias_px;
}

}  // namespace

StereoSolution solve_stereo(const BoardFinder& finder, const BoardRecording& recording,
                            const std::vector<std::size_t>& chosen, int coefficients,
                            double distance_mm) {
    StereoSolution solution;
    solution.used = chosen;
    require_pairs(solution, recording);
    for (int round = 0; round < BoardFit::kRounds; ++round) {
        fit(boards_of(finder, recording, solution.used), recording.size, flags_of(coefficients),
            solution);
        if (round + 1 == BoardFit::kRounds || !leave_out(solution)) break;
        require_pairs(solution, recording);
    }
    if (distance_mm > 0) solution.distance_mm = distance_mm;
    const Boards used = boards_of(finder, recording, solution.used);
    judge_coverage(used.left, recording.size, solution.left);
    judge_coverage(used.right, recording.size, solution.right);
    std::vector<std::size_t> judged;
    for (std::size_t i = 0; i < recording.frames.size(); ++i) {
        const auto has = [i](const std::vector<std::size_t>& frames) {
            return std::find(frames.begin(), frames.end(), i) != frames.end();
        };
        if (has(solution.used) || !has(chosen)) judged.push_back(i);
    }
    judge_stereo(boards_of(finder, recording, judged), recording.size, solution);
    return solution;
}

}  // namespace defrec::cli
