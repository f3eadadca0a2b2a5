// See board_frames.hpp.
#include "sdk/calibration/board_frames.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "sdk/calibration/decisions.hpp"
#include "sdk/input/view_image.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/interrupt.hpp"
#include "sdk/io/terminal.hpp"

namespace defrec::cli {
namespace {

using decisions::BoardFrames;

std::int64_t step_of(const std::optional<std::int64_t>& expected) {
    return std::max<std::int64_t>(
        1, (expected.value_or(0) + BoardFrames::kMaxSearched - 1) / BoardFrames::kMaxSearched);
}

// The corners of `view` that `other` has as well.
BoardView common(const BoardView& view, const BoardView& other) {
    BoardView made;
    made.sharpness = view.sharpness;
    for (std::size_t i = 0; i < view.ids.size(); ++i)
        if (std::find(other.ids.begin(), other.ids.end(), view.ids[i]) != other.ids.end()) {
            made.ids.push_back(view.ids[i]);
            made.corners.push_back(view.corners[i]);
        }
    return made;
}

void add(BoardRecording& recording, BoardFrame frame, bool has_markers) {
    if (frame.left.empty() || frame.right.empty()) {
        recording.only_left += frame.right.empty() && !frame.left.empty();
        recording.only_right += frame.left.empty() && !frame.right.empty();
        return;
    }
    if (!has_markers) turn_alike(frame.left, frame.right);
    const BoardView left = common(frame.left, frame.right);
    frame.right = common(frame.right, frame.left);
    frame.left = left;
    if (static_cast<int>(frame.left.ids.size()) >= BoardFrames::kMinCorners)
        recording.frames.push_back(std::move(frame));
}

[[noreturn]] void refuse(const BoardRecording& recording, const BoardFinder& finder,
                         const StereoFrame& shown) {
    const BoardDescription& board = finder.board();
    std::string text =
        "the board was not seen by both views in any of " + std::to_string(recording.searched) +
        " frames (by the left one alone in " + std::to_string(recording.only_left) +
        ", by the right one alone in " + std::to_string(recording.only_right) + "). Expected: " +
        (board.kind == BoardKind::kCharuco
             ? "a ChArUco board with markers of " + board.dictionary + ", "
             : "a chessboard, all of it in the image, ") +
        std::to_string(board.across) + "x" + std::to_string(board.down) + " squares.";
    for (const auto& [name, view] :
         {std::pair("left", &shown.left), std::pair("right", &shown.right)}) {
        const std::string closer = finder.look_closer(gray_of(*view));
        if (!closer.empty()) text += std::string(" The ") + name + " view " + closer;
    }
    throw CliError(ExitCode::kInput, text);
}

// Where a board is in a view: its middle in parts of the image's width, the logarithm of its size
// to the base 2, and tilts in units of 30 degrees.
using Place = cv::Vec<double, 5>;

Place place_of(const BoardFinder& finder, const BoardView& view, const cv::Size& size) {
    std::vector<cv::Point3f> board;
    for (const int id : view.ids) board.push_back(finder.place(id));
    // A camera whose image is as wide as its distance: only differences of tilts count.
    const double f = size.width;
    const cv::Matx33d camera(f, 0, 0.5 * size.width, 0, f, 0.5 * size.height, 0, 0, 1);
    cv::Vec3d turn, shift;
    cv::solvePnP(board, view.corners, camera, cv::noArray(), turn, shift, false, cv::SOLVEPNP_IPPE);
    cv::Matx33d rotation;
    cv::Rodrigues(turn, rotation);
    const double unit = std::numbers::pi / 6;
    const cv::Scalar middle = cv::mean(view.corners);
    const double away = std::max(cv::norm(shift), 1e-9);
    return {middle[0] / size.width, middle[1] / size.width, std::log2(away),
            std::asin(std::clamp(rotation(0, 2), -1.0, 1.0)) / unit,
            std::asin(std::clamp(rotation(1, 2), -1.0, 1.0)) / unit};
}

// The worse view's.
double sharpness_of(const BoardFrame& frame) {
    return std::min(frame.left.sharpness, frame.right.sharpness);
}

std::vector<std::size_t> sharp_frames(const std::vector<BoardFrame>& frames) {
    std::vector<double> values;
    for (const BoardFrame& frame : frames) values.push_back(sharpness_of(frame));
    std::vector<double> sorted = values;
    std::sort(sorted.begin(), sorted.end());
    const double sharp = sorted[3 * (sorted.size() - 1) / 4];
    std::vector<std::size_t> made;
    for (std::size_t i = 0; i < frames.size(); ++i)
        if (values[i] >= BoardFrames::kMinSharpness * sharp) made.push_back(i);
    return made;
}

}  // namespace

void turn_alike(const BoardView& left, BoardView& right) {
    const cv::Point2f one = left.corners.back() - left.corners.front(),
                      other = right.corners.back() - right.corners.front();
    if (one.dot(other) < 0) std::reverse(right.corners.begin(), right.corners.end());
}

BoardRecording find_boards(const SourceOptions& options, const BoardFinder& finder, bool quiet) {
    FrameSource source(options);
    BoardRecording recording;
    recording.size = cv::Size(source.width(), source.height());
    recording.fields = source.fields();
    const std::int64_t step = step_of(source.expected());
    StereoFrame frame, shown;
    ProgressBar progress(quiet);
    for (std::int64_t number = 0; source.next(frame); ++number) {
        throw_if_interrupted();
        if (number % step != 0) continue;
        shown = frame;
        ++recording.searched;
        add(recording,
            {frame.index, finder.find(gray_of(frame.left)), finder.find(gray_of(frame.right))},
            finder.board().kind == BoardKind::kCharuco);
        progress.update(number, source.expected(),
                        std::to_string(recording.frames.size()) + " with the board");
    }
    progress.clear();
    if (!source.fault().empty()) throw CliError(ExitCode::kInput, source.fault());
    if (recording.frames.empty()) refuse(recording, finder, shown);
    return recording;
}

std::vector<std::size_t> choose_frames(const BoardFinder& finder, const BoardRecording& recording) {
    const std::vector<BoardFrame>& frames = recording.frames;
    std::vector<std::size_t> left = sharp_frames(frames);
    std::vector<Place> places;
    for (const BoardFrame& frame : frames)
        places.push_back(place_of(finder, frame.left, recording.size));
    std::vector<double> nearest(frames.size(), std::numeric_limits<double>::infinity());
    std::size_t next = *std::max_element(left.begin(), left.end(), [&](auto a, auto b) {
        return sharpness_of(frames[a]) < sharpness_of(frames[b]);
    });
    std::vector<std::size_t> chosen;
    while (static_cast<int>(chosen.size()) < BoardFrames::kMaxPoses &&
           nearest[next] >= BoardFrames::kMinDistance) {
        chosen.push_back(next);
        for (const std::size_t i : left)
            nearest[i] = std::min(nearest[i], cv::norm(places[i] - places[next]));
        next = *std::max_element(left.begin(), left.end(),
                                 [&](auto a, auto b) { return nearest[a] < nearest[b]; });
    }
    return chosen;
}

}  // namespace defrec::cli
