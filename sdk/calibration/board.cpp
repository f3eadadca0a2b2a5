// See board.hpp. OpenCV finds the corners: A. Duda, U. Frese, "Accurate detection and localization
// of checkerboard corners for calibration", BMVC 2018; S. Garrido-Jurado et al., "Automatic
// generation and detection of highly reliable fiducial markers under occlusion", 2014.
#include "sdk/calibration/board.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "sdk/calibration/decisions.hpp"
#include "sdk/io/exit_code.hpp"

namespace defrec::cli {
namespace {

using decisions::BoardFrames;

const std::map<std::string, cv::aruco::PREDEFINED_DICTIONARY_NAME>& dictionaries() {
    static const std::map<std::string, cv::aruco::PREDEFINED_DICTIONARY_NAME> made = {
        {"4x4_50", cv::aruco::DICT_4X4_50},          {"4x4_100", cv::aruco::DICT_4X4_100},
        {"4x4_250", cv::aruco::DICT_4X4_250},        {"4x4_1000", cv::aruco::DICT_4X4_1000},
        {"5x5_50", cv::aruco::DICT_5X5_50},          {"5x5_100", cv::aruco::DICT_5X5_100},
        {"5x5_250", cv::aruco::DICT_5X5_250},        {"5x5_1000", cv::aruco::DICT_5X5_1000},
        {"6x6_50", cv::aruco::DICT_6X6_50},          {"6x6_100", cv::aruco::DICT_6X6_100},
        {"6x6_250", cv::aruco::DICT_6X6_250},        {"6x6_1000", cv::aruco::DICT_6X6_1000},
        {"7x7_50", cv::aruco::DICT_7X7_50},          {"7x7_100", cv::aruco::DICT_7X7_100},
        {"7x7_250", cv::aruco::DICT_7X7_250},        {"7x7_1000", cv::aruco::DICT_7X7_1000},
        {"original", cv::aruco::DICT_ARUCO_ORIGINAL}};
    return made;
}

std::string squares(int across, int down) {
    return std::to_string(across) + "x" + std::to_string(down);
}

void check(const BoardDescription& board) {
    const auto refuse = [](const std::string& what) { throw CliError(ExitCode::kUsage, what); };
    if ((board.across - 1) * (board.down - 1) < BoardFrames::kMinCorners || board.across < 4 ||
        board.down < 4)
        refuse("--squares: a board of " + squares(board.across, board.down) +
               " squares has too few inner corners; expected 4x4 and more, with " +
               std::to_string(BoardFrames::kMinCorners) + " inner corners or more.");
    if (board.kind != BoardKind::kCharuco) return;
    if (!(board.marker_mm > 0 && board.marker_mm < board.square_mm))
        refuse(
            "--marker: a ChArUco board has markers that are smaller than its squares; give "
            "their side in mm.");
    const int markers = board.across * board.down / 2;
    const auto dictionary = cv::aruco::getPredefinedDictionary(dictionaries().at(board.dictionary));
    if (dictionary->bytesList.rows < markers)
        refuse("--dictionary: " + board.dictionary + " has " +
               std::to_string(dictionary->bytesList.rows) + " markers; a board of " +
               squares(board.across, board.down) + " squares has " + std::to_string(markers) + ".");
}

// The steepest step in a window, in parts of its contrast, 1/px. 0: no contrast.
double steepest_step(const cv::Mat& gray, const cv::Point2f& corner, int radius) {
    const cv::Rect window = cv::Rect(cvRound(corner.x) - radius, cvRound(corner.y) - radius,
                                     2 * radius + 1, 2 * radius + 1) &
                            cv::Rect(0, 0, gray.cols, gray.rows);
    if (window.width < 3 || window.height < 3) return 0;
    const cv::Mat patch = gray(window);
    double least = 0, most = 0;
    cv::minMaxLoc(patch, &least, &most);
    if (most <= least) return 0;
    cv::Mat across, down, steps;
    cv::Sobel(patch, across, CV_32F, 1, 0, 3, 1.0 / 8);
    cv::Sobel(patch, down, CV_32F, 0, 1, 3, 1.0 / 8);
    cv::magnitude(across, down, steps);
    double steepest = 0;
    cv::minMaxLoc(steps, nullptr, &steepest);
    return steepest / (most - least);
}

// The median of its corners.
double sharpness_of(const cv::Mat& gray, const std::vector<cv::Point2f>& corners) {
    constexpr int kRadius = 4;  // px: beside the corner, within the squares of most boards
    std::vector<double> steps;
    for (const cv::Point2f& corner : corners) steps.push_back(steepest_step(gray, corner, kRadius));
    std::nth_element(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2),
                     steps.end());
    return steps[steps.size() / 2];
}

bool find_corners(const cv::Mat& gray, int across, int down, std::vector<cv::Point2f>& corners) {
    return cv::findChessboardCornersSB(gray, cv::Size(across - 1, down - 1), corners,
                                       cv::CALIB_CB_NORMALIZE_IMAGE);
}

// Where edges around a corner meet: W. Foerstner, E. Guelch, "A fast operator for detection and
// precise location of distinct points, corners and centres of circular features", 1987. share: half
// of the window, of the distance to the nearest corner.
void refine(const cv::Mat& gray, double share, std::vector<cv::Point2f>& corners) {
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < corners.size(); ++i)
        for (std::size_t k = i + 1; k < corners.size(); ++k)
            nearest = std::min(nearest, cv::norm(corners[i] - corners[k]));
    const int radius = std::clamp(static_cast<int>(share * nearest), BoardFrames::kMinWindow,
                                  BoardFrames::kMaxWindow);
    const cv::TermCriteria until(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 50, 1e-3);
    cv::cornerSubPix(gray, corners, cv::Size(radius, radius), cv::Size(-1, -1), until);
}

}  // namespace

struct BoardFinder::Markers {
    cv::Ptr<cv::aruco::Dictionary> dictionary;
    cv::Ptr<cv::aruco::CharucoBoard> board;
    cv::Ptr<cv::aruco::DetectorParameters> parameters = cv::aruco::DetectorParameters::create();
};

const std::vector<std::string>& marker_dictionaries() {
    static const std::vector<std::string> names = [] {
        std::vector<std::string> made;
        for (const auto& [name, dictionary] : dictionaries()) made.push_back(name);
        return made;
    }();
    return names;
}

BoardFinder::BoardFinder(const BoardDescription& board) : board_(board) {
    check(board);
    if (board.kind == BoardKind::kCharuco) {
        markers_ = std::make_unique<Markers>();
        markers_->dictionary =
            cv::aruco::getPredefinedDictionary(dictionaries().at(board.dictionary));
        markers_->board = cv::aruco::CharucoBoard::create(
            board.across, board.down, static_cast<float>(board.square_mm),
            static_cast<float>(board.marker_mm), markers_->dictionary);
        places_ = markers_->board->chessboardCorners;
        return;
    }
    for (int row = 0; row < board.down - 1; ++row)
        for (int column = 0; column < board.across - 1; ++column)
            places_.emplace_back(static_cast<float>(board.square_mm * column),
                                 static_cast<float>(board.square_mm * row), 0.0F);
}

BoardFinder::~BoardFinder() = default;

cv::Point3f BoardFinder::place(int id) const { return places_[static_cast<std::size_t>(id)]; }

BoardView BoardFinder::find_chessboard(const cv::Mat& gray) const {
    BoardView view;
    if (!find_corners(gray, board_.across, board_.down, view.corners)) return {};
    refine(gray, BoardFrames::kWindow, view.corners);
    for (std::size_t id = 0; id < view.corners.size(); ++id)
        view.ids.push_back(static_cast<int>(id));
    return view;
}

BoardView BoardFinder::find_charuco(const cv::Mat& gray) const {
    std::vector<std::vector<cv::Point2f>> markers, rejected;
    std::vector<int> ids;
    cv::aruco::detectMarkers(gray, markers_->dictionary, markers, ids, markers_->parameters,
                             rejected);
    if (ids.empty()) return {};
    cv::Ptr<cv::aruco::Board> board = markers_->board;
    cv::aruco::refineDetectedMarkers(gray, board, markers, ids, rejected);
    BoardView view;
    cv::aruco::interpolateCornersCharuco(markers, ids, gray, markers_->board, view.corners,
                                         view.ids);
    if (static_cast<int>(view.ids.size()) < BoardFrames::kMinCorners) return {};
    // Markers stay out of the window.
    const double gap = (board_.square_mm - board_.marker_mm) / (2 * board_.square_mm);
    refine(gray, std::min(BoardFrames::kWindow, gap), view.corners);
    return view;
}

BoardView BoardFinder::find(const cv::Mat& gray) const {
    BoardView view = markers_ ? find_charuco(gray) : find_chessboard(gray);
    if (!view.empty()) view.sharpness = sharpness_of(gray, view.corners);
    return view;
}

std::string BoardFinder::look_closer(const cv::Mat& gray) const {
    if (markers_) {
        cv::Mat mirrored;
        cv::flip(gray, mirrored, 1);
        return find_charuco(mirrored).empty()
                   ? ""
                   : "shows the board mirrored: mirror the images, and those that are tracked "
                     "likewise.";
    }
    std::vector<cv::Point2f> corners;
    if (find_corners(gray, board_.across + 1, board_.down + 1, corners))
        return "shows a board of " + squares(board_.across + 1, board_.down + 1) +
               " squares, not of " + squares(board_.across, board_.down) +
               ": squares are counted, not the corners between them.";
    return "";
}

}  // namespace defrec::cli
